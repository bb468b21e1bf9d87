#include <dlfcn.h>

#include <filesystem>
#include <string_view>

#include "emulator/plot/draw_module.hpp"
#include "emulator/program/cli.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

const DrawModule& load_draw_module() {
  // Found from where the program stands, as its configs are.
  const fs::path file =
      (fs::canonical("/proc/self/exe").parent_path() / LKEMU_MODULE_DIR / "draw.so")
          .lexically_normal();
  void* const opened = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (opened == nullptr) {
    const char* const why = ::dlerror();  // NOLINT(concurrency-mt-unsafe): one thread
    throw StartError("plot: cannot load what draws: " + std::string(why != nullptr ? why : "?"));
  }
  const auto* const module = static_cast<const DrawModule*>(::dlsym(opened, kDrawModuleSymbol));
  if (module == nullptr || std::string_view(module->version) != LKEMU_VERSION) {
    throw StartError("plot: " + file.string() + " belongs to another version of lk-emu");
  }
  return *module;
}

}  // namespace lk::emulator
