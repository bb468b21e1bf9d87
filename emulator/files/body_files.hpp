#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "emulator/config/config.hpp"

namespace lk::emulator {

/// Makes a body from a model file. Throws std::invalid_argument with file and reason.
using BodyMaker = std::shared_ptr<const Mechanism> (*)(const std::filesystem::path& file,
                                                       SimTime step);

/// Sets the maker of bodies for robots; null if the program does not support bodies.
void use_bodies(BodyMaker maker);

/// The file of the model that a robot file names. Throws std::invalid_argument: there is none.
std::filesystem::path body_file(const std::string& robot_file, const std::string& model);

/// For robot files: a model is a path from there, or the name of a shipped one.
LoadBody body_loader();

}  // namespace lk::emulator
