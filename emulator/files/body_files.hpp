#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "emulator/config/config.hpp"

namespace lk::emulator {

/// Makes a body of a model file. Throws std::invalid_argument with file and reason.
using BodyMaker = std::shared_ptr<const Mechanism> (*)(const std::filesystem::path& file,
                                                       SimTime step);

/// What makes the bodies of robots from now on, in a program that can; null: none does.
void use_bodies(BodyMaker maker);

/// The file of the model that a robot file names. Throws std::invalid_argument: there is none.
std::filesystem::path body_file(const std::string& robot_file, const std::string& model);

/// For robot files: a model is a path from there, or the name of a shipped one.
LoadBody body_loader();

}  // namespace lk::emulator
