#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
// Debian keeps the library without MPI in a folder of its own.
#if __has_include(<hdf5/serial/hdf5.h>)
#include <hdf5/serial/hdf5.h>
#else
#include <hdf5.h>
#endif

#include "identification/log/log_dialect.h"
#include "identification/log/mat_file.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

/// What the library has opened; negative where it could not.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  explicit operator bool() const { return id_ >= 0; }
  hid_t id() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

class PlainReader {
 public:
  PlainReader(const std::string& path, hid_t root, const DoorLimits& limits)
      : path_(path), root_(root), limits_(limits) {}

  std::optional<std::vector<MatValue>> read() {
    H5G_info_t root{};
    if (H5Gget_info(root_, &root) < 0) return std::nullopt;
    std::vector<MatValue> variables;
    for (hsize_t i = 0; i < root.nlinks; ++i) {
      MatValue value;
      H5L_info_t link{};
      if (H5Lget_info_by_idx(root_, ".", H5_INDEX_NAME, H5_ITER_INC, i, &link, H5P_DEFAULT) < 0)
        return std::nullopt;
      value.name = name_of(i);
      // What lies in other files is not read, nor what another name leads to.
      if (link.type == H5L_TYPE_HARD) {
        const Handle object(H5Oopen(root_, value.name.c_str(), H5P_DEFAULT), H5Oclose);
        if (object && H5Aexists(object.id(), "MATLAB_class") > 0) return std::nullopt;
        if (object && H5Iget_type(object.id()) == H5I_DATASET) read_data(object.id(), &value);
      }
      variables.push_back(std::move(value));
    }
    return variables;
  }

 private:
  std::string name_of(hsize_t i) const {
    const ssize_t size =
        H5Lget_name_by_idx(root_, ".", H5_INDEX_NAME, H5_ITER_INC, i, nullptr, 0, H5P_DEFAULT);
    std::string name(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
    H5Lget_name_by_idx(root_, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size() + 1,
                       H5P_DEFAULT);
    return name;
  }

  /// Whether the values lie in this file.
  static bool holds_its_values(hid_t data) {
    const Handle creation(H5Dget_create_plist(data), H5Pclose);
    return creation && H5Pget_external_count(creation.id()) == 0 &&
           H5Pget_layout(creation.id()) != H5D_VIRTUAL;
  }

  void read_data(hid_t data, MatValue* value) {
    const Handle type(H5Dget_type(data), H5Tclose);
    const Handle space(H5Dget_space(data), H5Sclose);
    if (!type || !space || !holds_its_values(data)) return;
    const H5T_class_t kind = H5Tget_class(type.id());
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if (rank < 0 || rank > 2) return;
    std::array<hsize_t, 2> size{1, 1};
    if (rank > 0 && H5Sget_simple_extent_dims(space.id(), size.data(), nullptr) < 0) return;
    value->rows = size[0], value->columns = size[1];
    if (kind == H5T_STRING && rank < 2) read_lines(data, type.id(), space.id(), value);
    if (kind == H5T_INTEGER || kind == H5T_FLOAT) read_numbers(data, value);
  }

  void read_numbers(hid_t data, MatValue* value) {
    const auto left = static_cast<hsize_t>(limits_.log_values) - read_;
    if (value->columns != 0 && value->rows > left / value->columns) {
      throw InputError({path_, 0, 0}, printable(value->name),
                       fmt::format("{} x {} values; a log may have {} in all (docs/limits.md)",
                                   value->rows, value->columns, limits_.log_values));
    }
    read_ += value->rows * value->columns;
    std::vector<double> stored(value->rows * value->columns);
    if (!stored.empty()) read_into(data, H5T_NATIVE_DOUBLE, value->name, stored.data());
    value->kind = MatValue::Kind::kNumbers;
    value->numbers.resize(stored.size());
    for (std::size_t row = 0; row < value->rows; ++row) {  // stored row by row
      for (std::size_t column = 0; column < value->columns; ++column) {
        const double v = stored[row * value->columns + column];
        value->numbers[row + column * value->rows] =
            std::isfinite(v) ? v : std::numeric_limits<double>::quiet_NaN();
      }
    }
  }

  void read_into(hid_t data, hid_t type, const std::string& name, void* out) const {
    if (H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out) >= 0) return;
    throw InputError({path_, 0, 0}, printable(name),
                     "its data cannot be read: it is damaged, or packed by a filter that HDF5 "
                     "itself does not have (lzf, blosc); save it with gzip or unpacked");
  }

  /// Names of columns; longer lists are none.
  void read_lines(hid_t data, hid_t type, hid_t space, MatValue* value) const {
    if (value->rows > static_cast<std::size_t>(limits_.log_columns)) return;
    value->kind = MatValue::Kind::kText;
    value->lines.resize(value->rows);
    if (H5Tis_variable_str(type) > 0) {
      std::vector<char*> texts(value->rows, nullptr);
      read_into(data, type, value->name, texts.data());
      for (std::size_t i = 0; i < texts.size(); ++i)
        value->lines[i] = texts[i] == nullptr ? "" : std::string(trimmed(texts[i]));
      H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
      return;
    }
    /// Longest text of fixed length that is taken for a name.
    /// @threshold [byte] 100..1e6; chosen: names of channels are shorter, and memory is this times log_columns
    constexpr std::size_t kLongest = 4096;
    const std::size_t size = H5Tget_size(type);
    if (size > kLongest) return;
    std::string texts(size * value->rows, '\0');
    read_into(data, type, value->name, texts.data());
    for (std::size_t i = 0; i < value->rows; ++i)
      value->lines[i] = std::string(trimmed(texts.substr(i * size, size).c_str()));
  }

  const std::string& path_;
  hid_t root_;
  const DoorLimits& limits_;
  hsize_t read_ = 0;  ///< values
};

}  // namespace

std::optional<std::vector<MatValue>> read_plain_hdf5(const std::string& path,
                                                     const DoorLimits& limits) {
  // The library would write its own messages to stderr.
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file) return std::nullopt;
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose);
  if (!root) return std::nullopt;
  return PlainReader(path, root.id(), limits).read();
}

}  // namespace sparflow
