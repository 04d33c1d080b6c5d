#include "identification/log/log_matlab.h"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>

#include "identification/log/log_dialect.h"
#include "identification/log/text_encoding.h"

namespace sparflow {
namespace {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

/// A numeric array in column-major order.
struct Array {
  std::string name;
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;
  bool vector() const { return rows == 1 || columns == 1; }
};

template <class T>
void copy_values(const matvar_t& variable, std::size_t count, std::vector<double>* out) {
  const T* data = static_cast<const T*>(variable.data);
  out->resize(count);
  std::transform(data, data + count, out->begin(), [](T v) { return static_cast<double>(v); });
}

/// @return false when the variable is not a real, dense, numeric array of two dimensions
bool read_array(const matvar_t& variable, Array* array) {
  if (variable.rank != 2 || variable.isComplex || variable.data == nullptr) return false;
  array->rows = variable.dims[0];
  array->columns = variable.dims[1];
  if (array->columns != 0 &&
      array->rows > std::numeric_limits<std::size_t>::max() / array->columns) {
    return false;
  }
  const std::size_t count = array->rows * array->columns;
  if (variable.data_size <= 0 ||
      variable.nbytes / static_cast<std::size_t>(variable.data_size) < count) {
    return false;  // a damaged file whose size does not match its data
  }
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      copy_values<double>(variable, count, &array->values);
      break;
    case MAT_C_SINGLE:
      copy_values<float>(variable, count, &array->values);
      break;
    case MAT_C_INT8:
      copy_values<std::int8_t>(variable, count, &array->values);
      break;
    case MAT_C_UINT8:
      copy_values<std::uint8_t>(variable, count, &array->values);
      break;
    case MAT_C_INT16:
      copy_values<std::int16_t>(variable, count, &array->values);
      break;
    case MAT_C_UINT16:
      copy_values<std::uint16_t>(variable, count, &array->values);
      break;
    case MAT_C_INT32:
      copy_values<std::int32_t>(variable, count, &array->values);
      break;
    case MAT_C_UINT32:
      copy_values<std::uint32_t>(variable, count, &array->values);
      break;
    case MAT_C_INT64:
      copy_values<std::int64_t>(variable, count, &array->values);
      break;
    case MAT_C_UINT64:
      copy_values<std::uint64_t>(variable, count, &array->values);
      break;
    default:
      return false;
  }
  for (double& v : array->values) {
    if (!std::isfinite(v)) v = std::numeric_limits<double>::quiet_NaN();
  }
  if (variable.name != nullptr) array->name = variable.name;
  return true;
}

/// @return row `row` of a char array
std::string read_text(const matvar_t& variable, std::size_t row) {
  std::string text;
  if (variable.class_type != MAT_C_CHAR || variable.rank != 2 || variable.data == nullptr)
    return text;
  const std::size_t rows = variable.dims[0], columns = variable.dims[1];
  const std::size_t size =
      variable.data_size > 0 ? static_cast<std::size_t>(variable.data_size) : 1;
  for (std::size_t j = 0; j < columns; ++j) {
    const std::size_t at = row + j * rows;
    if ((at + 1) * size > variable.nbytes) break;
    const unsigned code = size == 2 ? static_cast<const std::uint16_t*>(variable.data)[at]
                                    : static_cast<const std::uint8_t*>(variable.data)[at];
    text += code < 0x80 ? static_cast<char>(code) : '?';
  }
  return std::string(trimmed(text));
}

std::vector<std::string> read_names(matvar_t* variable) {
  std::vector<std::string> names;
  if (variable->class_type == MAT_C_CHAR && variable->rank == 2) {
    for (std::size_t i = 0; i < variable->dims[0]; ++i) names.push_back(read_text(*variable, i));
  } else if (variable->class_type == MAT_C_CELL && variable->rank == 2) {
    const std::size_t count = variable->dims[0] * variable->dims[1];
    for (std::size_t i = 0; i < count; ++i) {
      const matvar_t* cell = Mat_VarGetCell(variable, static_cast<int>(i));
      names.push_back(cell == nullptr ? "" : read_text(*cell, 0));
    }
  }
  return names;
}

std::string shape(const Array& array) {
  return fmt::format("{} ({} x {})", array.name, array.rows, array.columns);
}

class MatlabReader {
 public:
  explicit MatlabReader(const std::string& path) { table_.file = path; }

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
    static const bool quiet = [] {  // the library would write its own messages to stderr
      Mat_LogInitFunc("sparflow", [](int, char*) {});
      return true;
    }();
    static_cast<void>(quiet);
    const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(table_.file.c_str(), MAT_ACC_RDONLY));
    if (!file)
      fail("", "cannot be read as a MATLAB file; save it again, e.g. save('log.mat', '-v7')");
    table_.dialect = Mat_GetVersion(file.get()) == MAT_FT_MAT73 ? "MATLAB v7.3" : "MATLAB";
    int structs = 0;
    while (const Variable variable{Mat_VarReadNext(file.get())}) {
      if (variable->class_type == MAT_C_STRUCT) {
        if (++structs > 1) {
          fail(printable(variable->name == nullptr ? "" : variable->name),
               "a second struct; expected all signals as fields of one struct");
        }
        read_struct(variable.get());
      } else {
        read_variable(variable.get());
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

  void read_struct(matvar_t* variable) {
    const std::string name = printable(variable->name == nullptr ? "" : variable->name);
    if (variable->rank != 2 || variable->dims[0] * variable->dims[1] != 1) {
      fail(name, "a struct array, expected one struct whose fields are vectors");
    }
    const unsigned count = Mat_VarGetNumberOfFields(variable);
    char* const* const fields = Mat_VarGetStructFieldnames(variable);
    for (unsigned i = 0; i < count; ++i) {
      matvar_t* field = Mat_VarGetStructFieldByIndex(variable, i, 0);
      if (field != nullptr) read_variable(field, fields[i]);
    }
  }

  void read_variable(matvar_t* variable, const char* field_name = nullptr) {
    const char* raw_name = field_name != nullptr ? field_name : variable->name;
    const std::string name = printable(raw_name == nullptr ? "" : raw_name);
    if (name.starts_with('#')) return;  // internal to the library
    if (name == "names") {
      names_ = read_names(variable);
      if (names_.empty()) fail(name, "expected a cell array of char, or a char matrix");
      return;
    }
    Array array;
    if (read_array(*variable, &array)) {
      array.name = name;
      arrays_.push_back(std::move(array));
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
  std::vector<Array> arrays_;
  std::vector<std::string> names_;
  std::string others_;
};

}  // namespace

bool is_matlab(std::string_view bytes, const std::string& path) {
  return bytes.starts_with("MATLAB 5.0 MAT-file") || bytes.starts_with("MATLAB 7.3 MAT-file") ||
         bytes.starts_with("\x89HDF\r\n") || path.ends_with(".mat");
}

RawTable read_matlab(const std::string& path) { return MatlabReader(path).read(); }

}  // namespace sparflow
