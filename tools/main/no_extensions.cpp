// SQLite loads extensions by dlopen, where somebody asks it to. Nobody does; but a program that is
// linked with nothing shared would take dlopen from glibc, which warns that it then needs the
// libraries of the machine it was built on. The linker has this take its place
// (tools/CMakeLists.txt, --wrap).

extern "C" void* __wrap_dlopen(const char* /*file*/, int /*mode*/) noexcept { return nullptr; }
