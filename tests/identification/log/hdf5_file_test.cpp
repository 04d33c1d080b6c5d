/// Tests of HDF5 files that MATLAB did not write, as h5py and PyTables make them.
#include <gmock/gmock.h>

#include <filesystem>
#if __has_include(<hdf5/serial/hdf5.h>)
#include <hdf5/serial/hdf5.h>
#else
#include <hdf5.h>
#endif

#include "models/math/door.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::size_t kRows = 60;
const std::vector<std::string> kColumns = {"t_s", "q_boom_rad", "q_extension_m", "pA_boom_bar"};

double value_at(std::size_t column, std::size_t row) {
  const auto x = static_cast<double>(row);
  return column == 0 ? 0.02 * x : column == 1 ? 0.5 + 1e-3 * x : column == 2 ? 1.5 : 80.0 + x;
}

/// Writes one file; HDF5's own functions, as the library below h5py does.
class Hdf5Writer {
 public:
  explicit Hdf5Writer(const std::string& path, hsize_t user_block = 0) {
    const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
    if (user_block > 0) H5Pset_userblock(creation, user_block);
    file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, H5P_DEFAULT);
    H5Pclose(creation);
  }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;
  ~Hdf5Writer() { H5Fclose(file_); }
  hid_t file() const { return file_; }

  void numbers(const char* name, std::vector<hsize_t> size, const std::vector<double>& values,
               hid_t type = H5T_IEEE_F64LE, bool packed = false) const {
    const hid_t space = H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    if (packed) {
      H5Pset_chunk(creation, static_cast<int>(size.size()), size.data());
      H5Pset_shuffle(creation);
      H5Pset_deflate(creation, 6);
    }
    const hid_t data = H5Dcreate2(file_, name, type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(data), H5Pclose(creation), H5Sclose(space);
  }
  void vectors() const {
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      std::vector<double> values(kRows);
      for (std::size_t k = 0; k < kRows; ++k) values[k] = value_at(c, k);
      numbers(kColumns[c].c_str(), {kRows}, values, H5T_IEEE_F64LE, c == 1);
    }
  }
  void texts(const char* name, std::vector<const char*> texts) const {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE), H5Tset_cset(type, H5T_CSET_UTF8);
    const hsize_t size = texts.size();
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t data = H5Dcreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data());
    H5Dclose(data), H5Sclose(space), H5Tclose(type);
  }
  void fixed_texts(const char* name, std::size_t width, const std::string& padded) const {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, width), H5Tset_strpad(type, H5T_STR_NULLPAD);
    const hsize_t size = padded.size() / width;
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t data = H5Dcreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data());
    H5Dclose(data), H5Sclose(space), H5Tclose(type);
  }

 private:
  hid_t file_;
};

/// A matrix with a signal in each column, row by row as C keeps it.
std::vector<double> matrix() {
  std::vector<double> values;
  for (std::size_t k = 0; k < kRows; ++k)
    for (std::size_t c = 0; c < kColumns.size(); ++c) values.push_back(value_at(c, k));
  return values;
}

class PlainHdf5 : public test::LogFiles {
 protected:
  void expect_signals(const Log& log) const {
    ASSERT_EQ(log.samples(), static_cast<Eigen::Index>(kRows));
    for (std::size_t k = 0; k < kRows; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      EXPECT_DOUBLE_EQ(log.time[row], value_at(0, k));
      EXPECT_DOUBLE_EQ(log.find(Role::kJointPosition, 0)->values[row], value_at(1, k));
      EXPECT_DOUBLE_EQ(log.find(Role::kPressureA, 0)->values[row], value_at(3, k) * 1e5);
    }
    EXPECT_EQ(log.dialect, "HDF5");
  }
  Log read(const std::string& name) const { return load_log(path(name), test::small_crane()); }
  std::string error(const std::string& name) const {
    return message_of([&] { read(name); });
  }
};

TEST_F(PlainHdf5, VectorsAtTheRootAreReadUnderAnyName) {
  for (const char* name : {"log.mat", "log.h5"}) {
    {
      const Hdf5Writer writer(path(name));
      writer.vectors();
      writer.numbers("payload_kg", {}, {800.0}, H5T_STD_I16BE);
    }
    const Log log = read(name);
    expect_signals(log);
    EXPECT_DOUBLE_EQ(log.find(Role::kPayload)->values[kRows - 1], 800.0);
    EXPECT_THAT(log.warnings, IsEmpty());
  }
}

TEST_F(PlainHdf5, MatlabsHeaderBeforeItChangesNothing) {
  {
    const Hdf5Writer writer(path("log.mat"), 512);
    writer.vectors();
  }
  std::string bytes = read_bytes(path("log.mat"), 1'000'000);
  std::string header = "MATLAB 7.3 MAT-file, Platform: GLNXA64";
  header.resize(124, ' ');
  bytes.replace(0, 128, header + std::string("\x00\x02IM", 4));
  write("log.mat", bytes);
  expect_signals(read("log.mat"));
}

TEST_F(PlainHdf5, AMatrixIsReadWithNames) {
  {
    const Hdf5Writer writer(path("log.h5"));
    writer.numbers("data", {kRows, 4}, matrix());
    writer.texts("names", {kColumns[0].c_str(), kColumns[1].c_str(), kColumns[2].c_str(),
                           kColumns[3].c_str()});
  }
  expect_signals(read("log.h5"));
  {
    const Hdf5Writer writer(path("log.h5"));
    writer.numbers("data", {kRows, 4}, matrix(), H5T_IEEE_F64BE);
    std::string padded;
    for (std::string name : kColumns) {
      name.resize(13, '\0');
      padded += name;
    }
    writer.fixed_texts("names", 13, padded);
  }
  expect_signals(read("log.h5"));
}

TEST_F(PlainHdf5, GroupsCubesAndLinksToOtherFilesAreLeftOutWithAWarning) {
  {
    const Hdf5Writer other(path("other.h5"));
    other.vectors();
  }
  {
    const Hdf5Writer writer(path("log.h5"));
    writer.vectors();
    H5Gclose(H5Gcreate2(writer.file(), "group", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    writer.numbers("cube", {2, 2, 2}, std::vector<double>(8));
    H5Lcreate_external("other.h5", "/q_boom_rad", writer.file(), "link", H5P_DEFAULT, H5P_DEFAULT);
  }
  const Log log = read("log.h5");
  expect_signals(log);
  EXPECT_THAT(log.warnings, ElementsAre("variable cube left out: not a real numeric vector",
                                        "variable group left out: not a real numeric vector",
                                        "variable link left out: not a real numeric vector"));
}

TEST_F(PlainHdf5, MoreValuesThanALogMayHaveAreRefusedBeforeTheyAreRead) {
  {
    const Hdf5Writer writer(path("log.h5"));  // no value is written, the file stays small
    const hsize_t size[2] = {1'000'000'000'000, 1000}, piece[2] = {1000, 1};
    const hid_t space = H5Screate_simple(2, size, nullptr);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 2, piece);
    H5Dclose(H5Dcreate2(writer.file(), "t_s", H5T_IEEE_F64LE, space, H5P_DEFAULT, creation,
                        H5P_DEFAULT));
    H5Pclose(creation), H5Sclose(space);
  }
  ASSERT_LT(std::filesystem::file_size(path("log.h5")), 100'000U);
  EXPECT_EQ(error("log.h5"),
            "log.h5: t_s: 1000000000000 x 1000 values; a log may have 400000000 in all "
            "(docs/limits.md)");
}

TEST_F(PlainHdf5, WhatIsNoLogGetsASentence) {
  {
    const Hdf5Writer writer(path("log.h5"));
    H5Gclose(H5Gcreate2(writer.file(), "run", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  EXPECT_THAT(error("log.h5"),
              HasSubstr("no numeric variables; expected vectors named as columns"));
  EXPECT_THAT(error("log.h5"), HasSubstr("found run"));
  {
    const Hdf5Writer writer(path("log.h5"));
    writer.vectors();
  }
  write("log.h5", read_bytes(path("log.h5"), 1'000'000).substr(0, 700));
  EXPECT_EQ(error("log.h5"),
            "log.h5: found an HDF5 file that was cut or damaged, expected a MATLAB file (v4 to "
            "v7.3) or vectors at the root of an HDF5 file; save it again, e.g. save('log.mat', "
            "'-v7')");
}

TEST_F(PlainHdf5, AnyCutOrChangedByteIsReadOrGetsASentence) {
  {
    const Hdf5Writer writer(path("log.h5"));
    writer.vectors();
  }
  const std::string whole = read_bytes(path("log.h5"), 1'000'000);
  int cuts = 0, refused_cuts = 0, read_changed = 0;
  for (std::size_t at = 0; at < whole.size(); at += 211) {
    for (const bool cut : {true, false}) {
      std::string bytes = cut ? whole.substr(0, at) : whole;
      if (!cut) bytes[at] = static_cast<char>(bytes[at] ^ 0x5A);
      write("changed.h5", bytes);
      cuts += cut;
      try {
        read("changed.h5");
        read_changed += !cut;
      } catch (const InputError& e) {
        EXPECT_THAT(e.what(), HasSubstr("changed.h5"));
        refused_cuts += cut;
      }
    }
  }
  EXPECT_GT(cuts, 20);
  EXPECT_EQ(refused_cuts, cuts);
  EXPECT_GT(read_changed, 5);  // a changed value stays a value
}

}  // namespace
}  // namespace sparflow
