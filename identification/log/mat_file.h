#pragma once
/// Reads MATLAB files of the versions 4, 5 and 7 from memory. Every length in the file is compared with what is there, so
/// that a file that was cut or damaged is refused with a sentence; matio, which reads version 7.3 (HDF5), does not compare
/// them and hands out uninitialised memory. Formats: MATLAB, "MAT-File Format", R2023b, chapters 1 (5 and 7) and 2 (4).
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "models/math/door.h"

namespace sparflow {

/// A variable, a cell or a field. Kinds that logs do not need are kOther and have no content.
struct MatValue {
  enum class Kind { kNumbers, kText, kCells, kStruct, kOther };
  std::string name;
  Kind kind = Kind::kOther;
  std::size_t rows = 0, columns = 0;
  std::vector<double> numbers;     ///< column by column, NaN where not finite
  std::vector<std::string> lines;  ///< rows of a char array, without blanks at their ends
  std::vector<MatValue> children;  ///< cells column by column, or fields with their names
};

/// @return whether `bytes` begin as a MATLAB file of version 4, 5 or 7
bool is_mat_before_73(std::string_view bytes);

/// @param file name for messages
/// @throws InputError where the file ends early, a length does not fit, or compressed data is damaged
std::vector<MatValue> read_mat(std::string_view bytes, const std::string& file,
                               const DoorLimits& limits);

/// The root of an HDF5 file that no MATLAB wrote (h5py, PyTables), by the library that matio brings: what MATLAB writes as
/// version 7.3 bears attributes MATLAB_class, and without them matio knows no variable. Numbers are scalars, vectors and
/// matrices, text a list of names; groups, links to other files and data of more dimensions are kOther.
/// @return nothing where HDF5 cannot open the file, or MATLAB wrote it
/// @throws InputError for data that cannot be unpacked, and above the limits of a log
std::optional<std::vector<MatValue>> read_plain_hdf5(const std::string& path,
                                                     const DoorLimits& limits);

}  // namespace sparflow
