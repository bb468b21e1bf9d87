#pragma once

#include <string>
#include <vector>

#include "emulator/ground/language.hpp"
#include "tools/plot/picture.hpp"
#include "tools/plot/run_csv.hpp"

namespace lk::emulator {

/// A drive of a CSV file.
struct PlottedDrive {
  std::string bus;
  int id;

  bool operator==(const PlottedDrive&) const = default;
};

/// Which of them to show: those of a bus, those with these IDs; all, where nothing is said.
struct DriveChoice {
  std::string bus;
  std::vector<int> ids;
};

/// What is shown, and what there is besides.
struct ChosenDrives {
  std::vector<PlottedDrive> shown;
  std::vector<PlottedDrive> left_out;  // for want of colours
};

/// In the order of the columns. Throws StartError when a drive that was asked for is not there, or
/// more were asked for than there are colours.
ChosenDrives choose_drives(const std::vector<RunColumn>& columns, const DriveChoice& choice);

/// "drive 1", or "vcan0 drive 1".
std::string drive_name(const PlottedDrive& drive, Language language);

/// How many rows there were, and from when to when.
struct PlottedRows {
  long count = 0;
  double first_s = 0;
  double last_s = 0;
};

/// The four panels of `drives`. Reads all rows. Throws StartError.
Picture picture_of(RunCsv& csv, const ChosenDrives& drives, const std::string& title,
                   Language language, PlottedRows& rows);

}  // namespace lk::emulator
