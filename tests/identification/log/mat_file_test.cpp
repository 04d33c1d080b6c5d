/// Tests of MATLAB files that were cut or damaged: always a sentence, never values that are not in the file.
#include "identification/log/mat_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <matio.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>

#include "identification/log/log_matlab.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using testing::HasSubstr;

struct CloseMat {
  void operator()(mat_t* file) const { Mat_Close(file); }
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using MatVariable = std::unique_ptr<matvar_t, CloseMat>;

constexpr std::size_t kMatRows = 400;

double written(std::size_t column, std::size_t row) {
  return column == 0 ? 0.02 * static_cast<double>(row)
                     : static_cast<double>(column) + 1e-3 * static_cast<double>(row * row % 97);
}

const std::vector<std::string> kMatColumns = {"t_s", "q_boom_rad", "q_extension_m", "pA_boom_bar"};

struct MatFormat {
  const char* name;
  mat_ft version;
  matio_compression compression;
  bool in_struct;
};

class CutMatFile : public test::LogFiles, public testing::WithParamInterface<MatFormat> {
 protected:
  MatVariable column(std::size_t i) const {
    std::vector<double> data(kMatRows);
    for (std::size_t k = 0; k < kMatRows; ++k) data[k] = written(i, k);
    std::size_t dims[2] = {kMatRows, 1};
    return MatVariable(
        Mat_VarCreate(kMatColumns[i].c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, data.data(), 0));
  }

  std::string bytes_of_file() const {
    const std::string name = path("whole.mat");
    std::filesystem::remove(name);
    {
      const std::unique_ptr<mat_t, CloseMat> file(
          Mat_CreateVer(name.c_str(), nullptr, GetParam().version));
      EXPECT_TRUE(file);
      if (GetParam().in_struct) {
        std::size_t dims[2] = {1, 1};
        const char* fields[] = {kMatColumns[0].c_str(), kMatColumns[1].c_str(),
                                kMatColumns[2].c_str(), kMatColumns[3].c_str()};
        MatVariable all(Mat_VarCreateStruct("log", 2, dims, fields, 4));
        for (std::size_t i = 0; i < 4; ++i) {
          Mat_VarSetStructFieldByName(all.get(), fields[i], 0, column(i).release());
        }
        EXPECT_EQ(Mat_VarWrite(file.get(), all.get(), GetParam().compression), 0);
      } else {
        for (std::size_t i = 0; i < 4; ++i)
          EXPECT_EQ(Mat_VarWrite(file.get(), column(i).get(), GetParam().compression), 0);
      }
    }
    return read_bytes(name, 100'000'000);
  }

  /// @return the table, or nothing where an InputError was thrown
  std::optional<RawTable> read(const std::string& bytes) const {
    try {
      return read_matlab("cut.mat", bytes, DoorLimits{});
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr("cut.mat: "));
      return std::nullopt;
    }
  }
};

TEST_P(CutMatFile, TheWholeFileIsRead) {
  const std::optional<RawTable> table = read(bytes_of_file());
  ASSERT_TRUE(table);
  ASSERT_EQ(table->columns.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(table->columns[i].name, kMatColumns[i]);
    ASSERT_EQ(table->columns[i].values.size(), kMatRows);
    for (std::size_t k = 0; k < kMatRows; ++k)
      EXPECT_EQ(table->columns[i].values[k], written(i, k));
  }
}

TEST_P(CutMatFile, AnyCutGivesASentenceOrOnlyWhatIsInTheFile) {
  const std::string whole = bytes_of_file();
  std::size_t refused = 0, all = 0;
  for (std::size_t n = 0; n < whole.size(); n += n < 1000 ? 1 : 37) {
    ++all;
    const std::optional<RawTable> table = read(whole.substr(0, n));
    refused += !table;
    if (!table) continue;
    // only where the cut lies between two variables: those before it are whole
    for (const RawColumn& column : table->columns) {
      const auto i = static_cast<std::size_t>(
          std::find(kMatColumns.begin(), kMatColumns.end(), column.name) - kMatColumns.begin());
      ASSERT_LT(i, 4U);
      ASSERT_EQ(column.values.size(), kMatRows);
      for (std::size_t k = 0; k < kMatRows; ++k) ASSERT_EQ(column.values[k], written(i, k));
    }
  }
  EXPECT_GE(refused + 3, all);  // three ends of variables lie before the last
}

TEST_P(CutMatFile, DamagedBytesGiveASentenceOrATable) {
  const std::string whole = bytes_of_file();
  std::size_t refused = 0;
  std::mt19937 random(7);
  for (std::size_t trial = 0; trial < 4000; ++trial) {
    std::string damaged = whole;
    // the beginning, where lengths and types stand, more often
    const std::size_t range =
        trial % 2 == 0 ? std::min<std::size_t>(400, whole.size()) : whole.size();
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, range - 1)(random);
    damaged[at] = static_cast<char>(std::uniform_int_distribution<int>(0, 255)(random));
    refused += !read(damaged);
  }
  EXPECT_GT(refused, 100U);
}

class CompressedMatFile : public CutMatFile {};
TEST_P(CompressedMatFile, DamageIsNoticed) {
  const std::string whole = bytes_of_file();
  for (std::size_t at = 128 + 8; at < 128 + 8 + 1000 && at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    const std::optional<RawTable> table = read(damaged);
    if (!table) continue;
    // of a tag between two variables alone could both be read; values are never others than those written
    for (const RawColumn& column : table->columns) {
      for (std::size_t i = 0; i < 4; ++i) {
        if (column.name != kMatColumns[i]) continue;
        for (std::size_t k = 0; k < kMatRows; ++k) ASSERT_EQ(column.values[k], written(i, k)) << at;
      }
    }
  }
}

std::string mat_format_name(const testing::TestParamInfo<MatFormat>& format) {
  return format.param.name;
}
const MatFormat kCompressedVectors{"v7", MAT_FT_MAT5, MAT_COMPRESSION_ZLIB, false},
    kCompressedStruct{"v7struct", MAT_FT_MAT5, MAT_COMPRESSION_ZLIB, true};
INSTANTIATE_TEST_SUITE_P(Formats, CutMatFile,
                         testing::Values(MatFormat{"v4", MAT_FT_MAT4, MAT_COMPRESSION_NONE, false},
                                         MatFormat{"v5", MAT_FT_MAT5, MAT_COMPRESSION_NONE, false},
                                         MatFormat{"v5struct", MAT_FT_MAT5, MAT_COMPRESSION_NONE,
                                                   true},
                                         kCompressedVectors, kCompressedStruct),
                         mat_format_name);
INSTANTIATE_TEST_SUITE_P(Formats, CompressedMatFile,
                         testing::Values(kCompressedVectors, kCompressedStruct), mat_format_name);

TEST(MatFile, ASmallFileThatUnpacksToMuchIsRefused) {
  // the limit stands for memory; four thousand bytes unpack from about forty
  DoorLimits limits;
  limits.log_bytes = 4000;
  const std::string name =
      (std::filesystem::temp_directory_path() / fmt::format("sparflow_bomb_{}.mat", ::getpid()))
          .string();
  {
    const std::unique_ptr<mat_t, CloseMat> file(Mat_CreateVer(name.c_str(), nullptr, MAT_FT_MAT5));
    std::vector<double> zeros(100'000, 0.0);
    std::size_t dims[2] = {zeros.size(), 1};
    const MatVariable v(Mat_VarCreate("t_s", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, zeros.data(), 0));
    ASSERT_EQ(Mat_VarWrite(file.get(), v.get(), MAT_COMPRESSION_ZLIB), 0);
  }
  const std::string bytes = read_bytes(name, 100'000);
  std::filesystem::remove(name);
  try {
    read_mat(bytes, "bomb.mat", limits);
    FAIL() << "nothing thrown";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("unpacks to more than"));
  }
}

}  // namespace
}  // namespace sparflow
