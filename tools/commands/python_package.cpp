#include "tools/commands/python_package.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "emulator/files/profile_files.hpp"
#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

// As python3 -m, but without modules of the working directory, and with one line for what is
// missing. PYTHONPATH is for the processes that the module starts. Arguments: the command, the
// module, the directory of the package or nothing.
constexpr const char* kStart = R"(import importlib.util, os, runpy, sys
command, module, directory = sys.argv[1:4]
del sys.argv[1:4]
sys.path = [directory] * bool(directory) + [place for place in sys.path if place]
problem = ""
if sys.version_info < (3, 11):
    problem = "Python 3.11 or newer; %s is %d.%d" % (sys.executable, *sys.version_info[:2])
elif importlib.util.find_spec("lkemu") is None:
    problem = ("the Python package lkemu, which %s does not have: install the .deb or the wheel of lk-emu, "
               "or keep share/lk-emu of the tarball beside bin" % sys.executable)
if problem:
    sys.stderr.write("lk-emu: %s: needs %s\n" % (command, problem))
    sys.exit(2)
from lkemu.command import check_libraries
check_libraries(command)
if directory:
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [directory, os.environ.get("PYTHONPATH")]))
runpy.run_module(module, run_name="__main__", alter_sys=True)
)";

/// The Python of the environment that a wheel was installed into, or of the system that the Debian
/// package belongs to, stands beside the program; else the first one in PATH.
std::string interpreter(const fs::path& program) {
  const fs::path beside = program.parent_path() / "python3";
  return ::access(beside.c_str(), X_OK) == 0 ? beside.string() : "python3";
}

}  // namespace

fs::path python_directory() {
  std::error_code none_there;
  const fs::path installed = config_directory() / "python";
  if (fs::exists(installed / "lkemu", none_there)) return installed;
  // In a build tree config_directory() is a link to the configs of the sources.
  const fs::path sources = fs::weakly_canonical(config_directory(), none_there).parent_path();
  return fs::exists(sources / "python/lkemu", none_there) ? sources / "python" : fs::path();
}

void become_python(const std::string& module, int argc, const char* const* argv) {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  std::vector<std::string> words = {interpreter(program),       "-B", "-c", kStart, argv[0], module,
                                    python_directory().string()};
  words.insert(words.end(), argv + 1, argv + argc);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::setenv("LKEMU", program.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
  ::execvp(pointers.front(), pointers.data());
  const int error = errno;
  throw StartError(std::string(argv[0]) + ": " + words.front() + ": " + std::strerror(error) +
                   (error == ENOENT ? ": apt install python3" : ""));
}

}  // namespace lk::emulator
