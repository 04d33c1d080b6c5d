/// MDF 4 files written here byte by byte, with the offsets of the standard, and read back; and damaged ones.
#include "identification/log/recordings/mdf/mdf.h"

#include <gmock/gmock.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <random>

#include "models/math/error.h"
#include "tests/identification/log/recordings/mdf_writer.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::conversion;
using test::Field;
using test::le;
using test::MdfWriter;
using test::real;
using testing::HasSubstr;

constexpr unsigned kRows = 20;

/// Time, 12 bits from bit 3 of byte 8, a big-endian int16, a float32; one byte of invalidation bits.
std::string records() {
  std::string all;
  for (unsigned i = 0; i < kRows; ++i) {
    const auto signed_value =
        static_cast<std::uint16_t>(static_cast<std::int16_t>(-300 + 7 * static_cast<int>(i)));
    const float f = 0.5F * static_cast<float>(i);
    std::uint32_t word = 0;
    std::memcpy(&word, &f, 4);
    all += real(0.01 * i) + le((100U + i) << 3U, 2) + static_cast<char>(signed_value >> 8U) +
           static_cast<char>(signed_value & 0xFFU) + le(word, 4) + le(i == 5 ? 2 : 0, 1);
  }
  return all;
}

std::string zipped(const std::string& in, bool transposed, unsigned columns) {
  std::string turned;
  const std::size_t rows = in.size() / columns;
  for (std::size_t c = 0; transposed && c < columns; ++c) {
    for (std::size_t r = 0; r < rows; ++r) turned += in[r * columns + c];
  }
  if (transposed) turned += in.substr(rows * columns);
  const std::string& source = transposed ? turned : in;
  uLongf size = compressBound(source.size());
  std::string out(size, '\0');
  compress(reinterpret_cast<Bytef*>(out.data()), &size,
           reinterpret_cast<const Bytef*>(source.data()), source.size());
  out.resize(size);
  return "DT" + le(transposed ? 1 : 0, 1) + le(0, 1) + le(columns, 4) + le(in.size(), 8) +
         le(size, 8) + out;
}

std::string written(int storage) {
  MdfWriter w;
  const std::string data = records();
  std::uint64_t at = 0;
  if (storage == 0) {
    at = w.block("DT", {}, data);
  } else if (storage < 3) {
    at = w.block("DZ", {}, zipped(data, storage == 2, 17));
  } else {  // a list, cut inside a record, behind a header of lists
    const auto a = w.block("DT", {}, data.substr(0, 50));
    const auto b = w.block("DZ", {}, zipped(data.substr(50), true, 17));
    const auto list = w.block("DL", {0, a, b}, le(0, 4) + le(2, 4) + le(0, 8) + le(50, 8));
    at = w.block("HL", {list}, le(0, 8));
  }
  const auto rule = conversion(w, 1, {5.0, 0.5});
  const auto first = test::channels(w, {{"t", 2, 1, 4, 0, 0, 64},
                                        {"bits", 0, 0, 0, 3, 8, 12, rule},
                                        {"big", 0, 0, 3, 0, 10, 16, 0, 2, 1},
                                        {"f", 0, 0, 4, 0, 12, 32}});
  const auto cg = test::group(w, 0, first, {0, kRows, 16, 1});
  w.first(w.block("DG", {0, cg, at, 0}, le(0, 8)));
  return w.file;
}

void expect_values(const Recording& r) {
  ASSERT_EQ(r.channels.size(), 3u);
  for (unsigned i = 0; i < kRows; ++i) {
    EXPECT_DOUBLE_EQ(r.channels[0].time[i], 0.01 * i);
    EXPECT_DOUBLE_EQ(r.channels[0].values[i], 5.0 + 0.5 * (100 + i));
    EXPECT_EQ(std::isnan(r.channels[1].values[i]), i == 5);
    if (i != 5) {
      EXPECT_DOUBLE_EQ(r.channels[1].values[i], -300.0 + 7.0 * i);
    }
    EXPECT_DOUBLE_EQ(r.channels[2].values[i], 0.5 * i);
  }
}

TEST(Mdf, EveryStorageOfRecordsGivesTheSameValues) {
  for (int storage = 0; storage < 4; ++storage) {
    SCOPED_TRACE(storage);
    expect_values(read_recording(written(storage), "log.mf4"));
  }
}

TEST(Mdf, UnsortedRecordsAreSortedByTheirNumbers) {
  MdfWriter w;
  std::string data;
  for (unsigned i = 0; i < 10; ++i) {
    data += le(7, 2) + real(0.1 * i) + le(i, 1);
    if (i % 2 == 0) data += le(300, 2) + le(1000 + i, 4);
  }
  const auto at = w.block("DT", {}, data);
  const auto seconds = conversion(w, 1, {0.0, 0.2});
  const auto b = test::group(
      w, 0, test::channels(w, {{"t", 3, 1, 0, 0, 0, 0, seconds}, {"b", 0, 0, 0, 0, 0, 32}}),
      {300, 5, 4, 0});
  const auto a = test::group(
      w, b, test::channels(w, {{"t", 2, 1, 4, 0, 0, 64}, {"a", 0, 0, 0, 0, 8, 8}}), {7, 10, 9, 0});
  w.first(w.block("DG", {0, a, at, 0}, le(2, 8)));
  const Recording r = read_recording(w.file, "log.mf4");
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_EQ(r.channels[0].values[9], 9.0);
  EXPECT_DOUBLE_EQ(r.channels[1].time[4], 0.8);  // of a virtual master
  EXPECT_EQ(r.channels[1].values[4], 1008.0);
}

/// Where a bus logger keeps the bytes of its frames.
enum class Bytes { kInRecord, kSignalData, kRecordsOfTheirOwn, kLimited };

/// 40 frames of CAN: identifier 0x123 with a counter in its first byte, and every fourth an extended one.
std::string bus_log(Bytes kept) {
  MdfWriter w;
  std::string data, apart;
  for (unsigned i = 0; i < 40; ++i) {
    const bool extended = i % 4 == 3;
    const std::string bytes = extended ? std::string("\x05", 1) : le(i, 1) + le(1000 - i, 2);
    const std::string head = real(0.01 * i) + le(extended ? 0x18FF0001U : 0x123U, 4) +
                             le((extended ? 1U : 0U) | bytes.size() << 1U, 1);
    if (kept == Bytes::kInRecord || kept == Bytes::kLimited) {
      data += head + bytes + std::string(8 - bytes.size(), '\xFF');
    } else if (kept == Bytes::kSignalData) {
      data += head + le(apart.size(), 8);
    } else {
      data += le(2, 1) + le(bytes.size(), 4) + bytes + le(1, 1) + head + le(apart.size(), 8);
    }
    apart += le(bytes.size(), 4) + bytes;
  }
  const bool own = kept == Bytes::kRecordsOfTheirOwn;
  const auto at = w.block("DT", {}, data);
  std::uint64_t content = 0, second = 0;
  if (kept == Bytes::kSignalData) content = w.block("SD", {}, apart);
  if (own) {
    second =
        w.block("CG", {0, 0, w.text("bytes"), 0, 0, 0}, le(2, 8) + le(40, 8) + le(1, 8) + le(0, 8));
    content = second;
  }
  // The channel of the length is found by its place where the data has a length of its own, and by its name elsewhere.
  const bool limited = kept == Bytes::kLimited;
  const auto length =
      test::channels(w, {{limited ? "used" : "CAN_DataFrame.DataLength", 0, 0, 0, 1, 12, 7}});
  if (limited) content = length;
  const unsigned type = limited ? 5U : kept == Bytes::kInRecord ? 0U : 1U;
  const auto first =
      test::channels(w,
                     {{"Timestamp", 2, 1, 4, 0, 0, 64},
                      {"CAN_DataFrame.ID", 0, 0, 0, 0, 8, 29},
                      {"CAN_DataFrame.IDE", 0, 0, 0, 0, 12, 1},
                      {"CAN_DataFrame.DataBytes", type, 0, 10, 0, 13, 64, 0, 0, 0, content}},
                     length);
  const auto cg = test::group(w, second, first, {own ? 1U : 0U, 40, 21, 0});
  w.first(w.block("DG", {0, cg, at, 0}, le(own ? 1 : 0, 8)));
  return w.file;
}

class MdfBusLog : public test::LogFiles {};

TEST_F(MdfBusLog, FramesAreDecodedWhereverTheirBytesStand) {
  RecordingOptions options;
  options.dbc_files = {write("a.dbc",
                             "BO_ 291 A: 8 E\n SG_ count : 0|8@1+ (1,0) [0|0] \"\" E\n"
                             " SG_ p : 8|16@1+ (0.5,0) [0|0] \"bar\" E\n"
                             " SG_ beyond : 32|8@1+ (1,0) [0|0] \"\" E\n"
                             "BO_ 2566848513 B: 1 E\n SG_ b : 0|8@1+ (1,0) [0|0] \"\" E\n")};
  for (const Bytes kept :
       {Bytes::kInRecord, Bytes::kSignalData, Bytes::kRecordsOfTheirOwn, Bytes::kLimited}) {
    SCOPED_TRACE(static_cast<int>(kept));
    const Recording r = read_recording(bus_log(kept), "bus.mf4", options);
    ASSERT_EQ(r.channels.size(), 3u);
    EXPECT_EQ(r.channels[0].name, "count");
    ASSERT_EQ(r.channels[0].values.size(), 30u);
    EXPECT_EQ(r.channels[0].values[4], 5.0) << "the fourth frame is an extended one";
    EXPECT_DOUBLE_EQ(r.channels[0].time[4], 0.05);
    EXPECT_DOUBLE_EQ(r.channels[1].values[4], 0.5 * 995);
    EXPECT_EQ(r.channels[1].unit, "bar");
    EXPECT_EQ(r.channels[2].values.size(), 10u);
    EXPECT_EQ(r.channels[2].values[0], 5.0);
    EXPECT_THAT(r.warnings,
                testing::Contains(HasSubstr("30 values left out: their frames are too short")));
  }
}

TEST_F(MdfBusLog, WithoutADatabaseTheIdentifiersAreNamed) {
  EXPECT_THAT(message_of([] { read_recording(bus_log(Bytes::kSignalData), "bus.mf4"); }),
              HasSubstr("identifiers seen: 123 (30 frames), 18FF0001x (10 frames)"));
}

std::string error_of(const std::string& file) {
  try {
    read_recording(file, "log.mf4");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Mdf, DamageIsNamedWithByteAndBlock) {
  const std::string good = written(0);
  EXPECT_THAT(error_of(good.substr(0, 190)), HasSubstr("block DG"));
  std::string more = good;  // the count of records of the only channel group
  more.replace(good.find("##CG") + 24 + 48 + 8, 8, le(std::uint64_t{1} << 60U, 8));
  EXPECT_THAT(error_of(more), HasSubstr("1152921504606846976 records by its count"));
  std::string circle = good;  // the data group follows itself
  circle.replace(good.find("##DG") + 24, 8, le(good.find("##DG"), 8));
  EXPECT_THAT(error_of(circle), HasSubstr("block DG: links lead to this block twice"));
  std::string bomb = written(1);
  bomb.replace(bomb.find("##DZ") + 24 + 8, 8, le(std::uint64_t{1} << 60U, 8));
  EXPECT_THAT(error_of(bomb), HasSubstr("block DZ"));
  std::string lost =
      bus_log(Bytes::kSignalData);  // the first frame's bytes lie beyond the signal data
  lost.replace(lost.find("##DT") + 24 + 13, 8, le(1U << 20U, 8));
  EXPECT_THAT(error_of(lost), HasSubstr("points to byte 1048576 of its data of variable length"));
}

TEST(Mdf, ThreeThousandChangedFilesAreReadOrRefused) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return random() % n; };
  int refused = 0;
  for (int k = 0; k < 3000; ++k) {
    std::string file = k % 8 < 4 ? written(k % 8) : bus_log(static_cast<Bytes>(k % 8 - 4));
    for (std::size_t e = 1 + below(4); e > 0; --e) {
      const std::size_t at = 64 + below(file.size() - 72);
      if (below(3) == 0) {
        file.replace(at / 8 * 8, 8,
                     le(random() % 2 == 0 ? below(file.size()) / 8 * 8 : ~0ULL >> below(40), 8));
      } else {
        file[at] = static_cast<char>(below(256));
      }
    }
    RecordingOptions options;
    options.limits.log_bytes = 10'000'000, options.limits.log_values = 100'000;
    try {
      read_recording(file, "log.mf4", options);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);  // one change in three or more hits a length or link
}

}  // namespace
}  // namespace sparflow
