#include "identification/log/log_matlab.h"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "identification/log/log_dialect.h"
#include "identification/log/mat_file.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

template <class T>
void copy_values(const matvar_t& variable, std::size_t count, std::vector<double>* out) {
  const T* data = static_cast<const T*>(variable.data);
  out->resize(count);
  std::transform(data, data + count, out->begin(), [](T v) {
    const auto value = static_cast<double>(v);
    return std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
  });
}

/// @return false when the variable is not a real, dense, numeric array
bool copy_numbers(const matvar_t& variable, std::size_t count, std::vector<double>* out) {
  if (variable.isComplex || variable.data == nullptr || variable.data_size <= 0) return false;
  if (variable.nbytes / static_cast<std::size_t>(variable.data_size) < count) return false;
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      copy_values<double>(variable, count, out);
      return true;
    case MAT_C_SINGLE:
      copy_values<float>(variable, count, out);
      return true;
    case MAT_C_INT8:
      copy_values<std::int8_t>(variable, count, out);
      return true;
    case MAT_C_UINT8:
      copy_values<std::uint8_t>(variable, count, out);
      return true;
    case MAT_C_INT16:
      copy_values<std::int16_t>(variable, count, out);
      return true;
    case MAT_C_UINT16:
      copy_values<std::uint16_t>(variable, count, out);
      return true;
    case MAT_C_INT32:
      copy_values<std::int32_t>(variable, count, out);
      return true;
    case MAT_C_UINT32:
      copy_values<std::uint32_t>(variable, count, out);
      return true;
    case MAT_C_INT64:
      copy_values<std::int64_t>(variable, count, out);
      return true;
    case MAT_C_UINT64:
      copy_values<std::uint64_t>(variable, count, out);
      return true;
    default:
      return false;
  }
}

/// @return row `row` of a char array
std::string read_line(const matvar_t& variable, std::size_t row) {
  std::string text;
  if (variable.data == nullptr) return text;
  const std::size_t rows = variable.dims[0], columns = variable.dims[1];
  const std::size_t size =
      variable.data_size > 0 ? static_cast<std::size_t>(variable.data_size) : 1;
  for (std::size_t j = 0; j < columns; ++j) {
    const std::size_t at = row + j * rows;
    if ((at + 1) * size > variable.nbytes) break;
    const unsigned code = size == 2 ? static_cast<const std::uint16_t*>(variable.data)[at]
                                    : static_cast<const std::uint8_t*>(variable.data)[at];
    text += code > 0 && code < 0x80 ? static_cast<char>(code) : '?';
  }
  return std::string(trimmed(text));
}

/// What matio read, as the reader of the older versions gives it. Null pointers stand for what matio could not read.
MatValue from_matio(matvar_t* variable, int depth, const DoorLimits& limits) {
  MatValue value;
  if (variable == nullptr) return value;
  if (variable->name != nullptr) value.name = variable->name;
  if (variable->rank != 2 || variable->dims == nullptr || depth > limits.nesting) return value;
  value.rows = variable->dims[0], value.columns = variable->dims[1];
  if (value.columns != 0 &&
      value.rows > static_cast<std::size_t>(limits.log_values) / value.columns)
    return value;
  const std::size_t count = value.rows * value.columns;
  if (variable->class_type == MAT_C_CHAR) {
    value.kind = MatValue::Kind::kText;
    for (std::size_t i = 0; i < value.rows && i * variable->dims[1] < variable->nbytes; ++i) {
      value.lines.push_back(read_line(*variable, i));
    }
  } else if (variable->class_type == MAT_C_CELL) {
    value.kind = MatValue::Kind::kCells;
    if (variable->data == nullptr || count > variable->nbytes / sizeof(matvar_t*)) return value;
    for (std::size_t i = 0; i < count; ++i) {
      value.children.push_back(
          from_matio(Mat_VarGetCell(variable, static_cast<int>(i)), depth + 1, limits));
    }
  } else if (variable->class_type == MAT_C_STRUCT) {
    value.kind = MatValue::Kind::kStruct;
    char* const* const fields = Mat_VarGetStructFieldnames(variable);
    const unsigned number = Mat_VarGetNumberOfFields(variable);
    for (unsigned i = 0; count == 1 && fields != nullptr && i < number; ++i) {
      matvar_t* field = Mat_VarGetStructFieldByIndex(variable, i, 0);
      if (field == nullptr || fields[i] == nullptr) continue;
      value.children.push_back(from_matio(field, depth + 1, limits));
      value.children.back().name = fields[i];
    }
  } else if (copy_numbers(*variable, count, &value.numbers)) {
    value.kind = MatValue::Kind::kNumbers;
  }
  return value;
}

constexpr std::string_view kHdf5 = "\x89HDF\r\n";  // no threshold: mark of the format

/// The variables of a file of version 7.3. @throws InputError when HDF5 cannot open it
std::vector<MatValue> read_mat_73(const std::string& path, std::string_view bytes,
                                  const DoorLimits& limits) {
  static const bool quiet = [] {  // the library would write its own messages to stderr
    Mat_LogInitFunc("sparflow", [](int, char*) {});
    return true;
  }();
  static_cast<void>(quiet);
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) {
    const bool hdf5 = bytes.starts_with(kHdf5) || bytes.starts_with("MATLAB 7.3 MAT-file");
    throw InputError(
        {path, 0, 0}, "",
        fmt::format("found {}, expected a MATLAB file (v4 to v7.3) or vectors at the root of an "
                    "HDF5 file; save it again, e.g. save('log.mat', '-v7')",
                    hdf5 ? "an HDF5 file that was cut or damaged" : "a header of another kind"));
  }
  std::vector<MatValue> variables;
  while (const Variable variable{Mat_VarReadNext(file.get())}) {
    variables.push_back(from_matio(variable.get(), 1, limits));
  }
  return variables;
}

/// A numeric array in column-major order.
struct Array {
  std::string name;
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;
  bool vector() const { return rows == 1 || columns == 1; }
};

std::vector<std::string> read_names(const MatValue& variable) {
  if (variable.kind == MatValue::Kind::kText) return variable.lines;
  std::vector<std::string> names;
  for (const MatValue& cell : variable.children) {
    names.push_back(cell.lines.empty() ? "" : cell.lines.front());
  }
  return names;
}

std::string shape(const Array& array) {
  return fmt::format("{} ({} x {})", array.name, array.rows, array.columns);
}

class MatlabReader {
 public:
  MatlabReader(const std::string& path, std::vector<MatValue> variables)
      : variables_(std::move(variables)) {
    table_.file = path;
  }

  RawTable read() {
    read_variables();
    if (!names_.empty()) {
      columns_from_matrix();
    } else {
      columns_from_vectors();
    }
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& message) const {
    throw InputError({table_.file, 0, 0}, key, message);
  }

  void read_variables() {
    int structs = 0;
    for (MatValue& variable : variables_) {
      if (variable.kind == MatValue::Kind::kStruct) {
        if (++structs > 1) {
          fail(printable(variable.name),
               "a second struct; expected all signals as fields of one struct");
        }
        read_struct(variable);
      } else {
        read_variable(variable);
      }
    }
    if (arrays_.empty()) {
      fail("",
           fmt::format(
               "no numeric variables; expected vectors named as columns (t_s, q_boom_rad, ...), "
               "one struct of them, or a matrix with `names`{}",
               others_.empty() ? "" : "; found " + others_));
    }
  }

  void read_struct(MatValue& variable) {
    if (variable.rows * variable.columns != 1) {
      fail(printable(variable.name),
           "a struct array, expected one struct whose fields are vectors");
    }
    for (MatValue& field : variable.children) read_variable(field);
  }

  void read_variable(MatValue& variable) {
    const std::string name = printable(variable.name);
    if (name.starts_with('#')) return;  // internal to the library
    if (name == "names") {
      names_ = read_names(variable);
      if (names_.empty())
        fail(name, "expected a cell array of char, a char matrix, or text in HDF5");
      return;
    }
    if (variable.kind == MatValue::Kind::kNumbers) {
      arrays_.push_back({name, variable.rows, variable.columns, std::move(variable.numbers)});
    } else {
      others_ += (others_.empty() ? "" : ", ") + name;
      table_.warnings.push_back(
          fmt::format("variable {} left out: not a real numeric vector", name));
    }
  }

  void columns_from_matrix() {
    const auto fits = [&](const Array& a) {
      return a.columns == names_.size() || a.rows == names_.size();
    };
    const Array* matrix = nullptr;
    for (const Array& array : arrays_) {
      if (!fits(array) || (array.vector() && names_.size() > 1)) continue;
      if (matrix != nullptr) {
        fail(array.name, fmt::format("both {} and {} fit the {} names; keep one", shape(*matrix),
                                     shape(array), names_.size()));
      }
      matrix = &array;
    }
    if (matrix == nullptr) {
      std::string found;
      for (const Array& array : arrays_) found += (found.empty() ? "" : ", ") + shape(array);
      fail("names", fmt::format("{} names, but no matrix with that many columns; found {}",
                                names_.size(), found));
    }
    const bool across = matrix->columns != names_.size();  // each row is a signal
    const std::size_t rows = across ? matrix->columns : matrix->rows;
    if (rows < 2) fail(matrix->name, "expected at least two instants");
    for (std::size_t i = 0; i < names_.size(); ++i) {
      RawColumn column;
      column.name = printable(names_[i]);
      column.values.resize(rows);
      for (std::size_t k = 0; k < rows; ++k) {
        column.values[k] = matrix->values[across ? i + k * matrix->rows : k + i * matrix->rows];
      }
      table_.columns.push_back(std::move(column));
    }
  }

  void columns_from_vectors() {
    // The length of most vectors is taken for the log; scalars become constant columns.
    std::map<std::size_t, int> lengths;
    for (const Array& array : arrays_) {
      if (array.vector() && array.values.size() > 1) ++lengths[array.values.size()];
    }
    if (lengths.empty()) {
      fail(arrays_.front().name,
           fmt::format("{} is no vector; give a matrix its columns' names in a variable `names`",
                       shape(arrays_.front())));
    }
    const auto most =
        std::max_element(lengths.begin(), lengths.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    const std::size_t rows = most->first;
    for (Array& array : arrays_) {
      RawColumn column;
      column.name = array.name;
      if (array.vector() && array.values.size() == rows) {
        column.values = std::move(array.values);
      } else if (array.values.size() == 1) {
        column.values.assign(rows, array.values.front());
      } else if (array.vector() && array.values.size() > 1) {
        fail(array.name,
             fmt::format("{} values, where most variables have {}; put all signals on one time",
                         array.values.size(), rows));
      } else {
        table_.warnings.push_back(fmt::format("variable {} left out: not a vector", shape(array)));
        continue;
      }
      table_.columns.push_back(std::move(column));
    }
  }

  RawTable table_;
  std::vector<MatValue> variables_;
  std::vector<Array> arrays_;
  std::vector<std::string> names_;
  std::string others_;
};

}  // namespace

bool is_matlab(std::string_view bytes, const std::string& path) {
  return bytes.starts_with("MATLAB 5.0 MAT-file") || bytes.starts_with("MATLAB 7.3 MAT-file") ||
         bytes.starts_with(kHdf5) || path.ends_with(".mat");
}

RawTable read_matlab(const std::string& path, std::string_view bytes, const DoorLimits& limits) {
  const bool before = is_mat_before_73(bytes);
  std::optional<std::vector<MatValue>> plain;
  if (!before) plain = read_plain_hdf5(path, limits);
  const char* dialect = before ? "MATLAB" : plain ? "HDF5" : "MATLAB v7.3";
  std::vector<MatValue> variables = before  ? read_mat(bytes, path, limits)
                                    : plain ? std::move(*plain)
                                            : read_mat_73(path, bytes, limits);
  RawTable table = MatlabReader(path, std::move(variables)).read();
  table.dialect = dialect;
  return table;
}

}  // namespace sparflow
