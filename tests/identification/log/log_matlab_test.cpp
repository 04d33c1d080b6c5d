/// Tests of .mat files of both formats in the three supported shapes.
#include "identification/log/log_matlab.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <matio.h>

#include <memory>

#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Free {
  void operator()(mat_t* file) const { Mat_Close(file); }
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, Free>;

constexpr std::size_t kMatlabRows = 50;
const std::vector<std::string> kNames = {"t_s", "q_boom_rad", "q_extension_m", "pA_boom_bar"};

/// 50 instants of the four signals, column by column.
std::vector<double> signals() {
  std::vector<double> v(kMatlabRows * 4);
  for (std::size_t i = 0; i < kMatlabRows; ++i) {
    const auto x = static_cast<double>(i);
    v[i] = 0.02 * x, v[kMatlabRows + i] = 0.5 + 1e-3 * x, v[2 * kMatlabRows + i] = 1.5;
    v[3 * kMatlabRows + i] = 80.0 + static_cast<double>(i % 7);
  }
  return v;
}

Variable matrix(const char* name, std::size_t rows, std::size_t columns, const double* data) {
  std::size_t dims[2] = {rows, columns};
  return Variable(
      Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, const_cast<double*>(data), 0));
}

Variable text(const char* name, const std::string& content) {
  std::size_t dims[2] = {1, content.size()};
  return Variable(
      Mat_VarCreate(name, MAT_C_CHAR, MAT_T_UTF8, 2, dims, const_cast<char*>(content.data()), 0));
}

class MatlabFiles : public test::LogFiles, public testing::WithParamInterface<mat_ft> {
 protected:
  std::string save(const std::vector<matvar_t*>& variables) const {
    const std::string name = path("log.mat");
    std::filesystem::remove(name);
    const std::unique_ptr<mat_t, Free> file(Mat_CreateVer(name.c_str(), nullptr, GetParam()));
    if (!file) return name;
    for (matvar_t* v : variables) Mat_VarWrite(file.get(), v, MAT_COMPRESSION_NONE);
    return name;
  }
  std::vector<Variable> vectors() const {
    const std::vector<double> v = signals();
    std::vector<Variable> all;
    for (std::size_t c = 0; c < 4; ++c) {  // columns and rows both
      all.push_back(c % 2 == 0 ? matrix(kNames[c].c_str(), kMatlabRows, 1, &v[c * kMatlabRows])
                               : matrix(kNames[c].c_str(), 1, kMatlabRows, &v[c * kMatlabRows]));
    }
    return all;
  }
  static std::vector<matvar_t*> pointers(const std::vector<Variable>& all) {
    std::vector<matvar_t*> raw;
    for (const Variable& v : all) raw.push_back(v.get());
    return raw;
  }
  void expect_signals(const Log& log) const {
    const std::vector<double> v = signals();
    ASSERT_EQ(log.samples(), static_cast<Eigen::Index>(kMatlabRows));
    EXPECT_DOUBLE_EQ(log.time[7], v[7]);
    EXPECT_DOUBLE_EQ(log.find(Role::kJointPosition, 0)->values[9], v[kMatlabRows + 9]);
    EXPECT_DOUBLE_EQ(log.find(Role::kPressureA, 0)->values[5], v[3 * kMatlabRows + 5] * 1e5);
    EXPECT_THAT(log.warnings, IsEmpty());
    EXPECT_EQ(log.sha256.size(), 64u);
  }
  std::string error(const std::vector<matvar_t*>& variables) const {
    const std::string name = save(variables);
    return message_of([&] { load_log(name, test::small_crane()); });
  }
};

TEST_P(MatlabFiles, VectorsAreReadByName) {
  std::vector<Variable> all = vectors();
  const double payload = 800.0;
  all.push_back(matrix("payload_kg", 1, 1, &payload));
  const Log log = load_log(save(pointers(all)), test::small_crane());
  expect_signals(log);
  EXPECT_DOUBLE_EQ(log.find(Role::kPayload)->values[kMatlabRows - 1], 800.0);
}

TEST_P(MatlabFiles, AStructIsReadByItsFields) {
  std::vector<Variable> all = vectors();
  std::vector<const char*> names;
  for (const std::string& n : kNames) names.push_back(n.c_str());
  std::size_t dims[2] = {1, 1};
  const Variable log_struct(Mat_VarCreateStruct("log", 2, dims, names.data(), 4));
  for (std::size_t c = 0; c < 4; ++c) {
    Mat_VarSetStructFieldByName(log_struct.get(), names[c], 0, all[c].release());
  }
  expect_signals(load_log(save({log_struct.get()}), test::small_crane()));
}

TEST_P(MatlabFiles, AMatrixIsReadWithNames) {
  const std::vector<double> v = signals();
  const Variable data = matrix("data", kMatlabRows, 4, v.data());
  std::size_t dims[2] = {1, 4};
  const Variable names(Mat_VarCreate("names", MAT_C_CELL, MAT_T_CELL, 2, dims, nullptr, 0));
  for (int c = 0; c < 4; ++c) {
    Mat_VarSetCell(names.get(), c, text(nullptr, kNames[static_cast<std::size_t>(c)]).release());
  }
  expect_signals(load_log(save({data.get(), names.get()}), test::small_crane()));
}

TEST_P(MatlabFiles, AMatrixWithSignalsInRowsIsReadWithACharMatrixOfNames) {
  const std::vector<double> v = signals();
  std::vector<double> across(v.size());
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t i = 0; i < kMatlabRows; ++i) across[c + 4 * i] = v[c * kMatlabRows + i];
  }
  const Variable data = matrix("data", 4, kMatlabRows, across.data());
  std::string padded(4 * 13, ' ');  // column by column, as MATLAB keeps it
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t j = 0; j < kNames[c].size(); ++j) padded[c + 4 * j] = kNames[c][j];
  }
  std::size_t dims[2] = {4, 13};
  const Variable names(Mat_VarCreate("names", MAT_C_CHAR, MAT_T_UTF8, 2, dims, padded.data(), 0));
  expect_signals(load_log(save({data.get(), names.get()}), test::small_crane()));
}

TEST_P(MatlabFiles, WrongShapesAreRefusedWithAMessage) {
  const std::vector<double> v = signals();
  EXPECT_EQ(
      error({matrix("data", kMatlabRows, 4, v.data()).get()}),
      "log.mat: data: data (50 x 4) is no vector; give a matrix its columns' names in a variable "
      "`names`");
  std::vector<Variable> all = vectors();
  all.push_back(matrix("pB_boom_bar", 40, 1, v.data()));
  EXPECT_EQ(
      error(pointers(all)),
      "log.mat: pB_boom_bar: 40 values, where most variables have 50; put all signals on one time");
  const Variable comment = text("comment", "cold day");
  EXPECT_EQ(error({comment.get()}),
            "log.mat: no numeric variables; expected vectors named as columns (t_s, q_boom_rad, "
            "...), one "
            "struct of them, or a matrix with `names`; found comment");
  all.pop_back();
  std::vector<matvar_t*> with_text = pointers(all);
  with_text.push_back(comment.get());
  EXPECT_THAT(load_log(save(with_text), test::small_crane()).warnings,
              ElementsAre("variable comment left out: not a real numeric vector"));
}

TEST_P(MatlabFiles, DecreasingTimeIsRefusedWithItsRow) {
  std::vector<double> v = signals();
  v[30] = 0.0;
  std::vector<Variable> all = vectors();
  all[0] = matrix("t_s", kMatlabRows, 1, v.data());
  EXPECT_EQ(
      error(pointers(all)),
      "log.mat: t_s: time goes back from 0.58 to 0 s in row 31; two logs in one file? Cut it here");
}

TEST_P(MatlabFiles, ADamagedFileIsRefused) {
  const std::string name = save(pointers(vectors()));
  const std::string bytes = read_file(name);
  for (const std::size_t keep :
       {std::size_t{0}, std::size_t{60}, std::size_t{130}, bytes.size() / 2}) {
    write("log.mat", bytes.substr(0, keep));
    EXPECT_THAT(message_of([&] { load_log(name, test::small_crane()); }), HasSubstr("log.mat: "))
        << keep;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, MatlabFiles, testing::Values(MAT_FT_MAT5, MAT_FT_MAT73),
                         [](const auto& format) {
                           return format.param == MAT_FT_MAT5 ? "v5" : "v73";
                         });

}  // namespace
}  // namespace sparflow
