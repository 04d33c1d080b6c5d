/// MCAP files that are damaged, hostile or larger than the limits: each is refused with the place, or read but for what is bad.
#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "identification/log/recordings/mcap/topic_samples.h"
#include "models/math/error.h"
#include "tests/identification/log/recordings/mcap_bags.h"

namespace sparflow {
namespace {

using test::bag_records;
using test::CdrMessage;
using test::find_channel;
using test::McapWriter;
using test::ns_at;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

TEST(DamagedMcap, AJsonMessageAboveTheLimitIsLeftOutBeforeItIsParsed) {
  const std::string small = R"({"p":1.5})";
  // longer than TopicOptions::longest_json, and otherwise a message like the other
  const std::string large =
      R"({"p":2.5,"who":")" + std::string(TopicOptions{}.longest_json, 'x') + R"("})";
  const Recording r = read_recording(McapWriter()
                                         .add(McapWriter::channel(4, 0, "press", "json"))
                                         .add(McapWriter::message(4, ns_at(0), 0, small))
                                         .add(McapWriter::message(4, ns_at(1), 0, large))
                                         .finished(),
                                     "a.mcap");
  ASSERT_THAT(r.channels, SizeIs(1));
  EXPECT_THAT(r.channels[0].values, ElementsAre(1.5));
  EXPECT_THAT(r.warnings, ElementsAre("left out, JSON messages of more than 4000000 bytes: 1 of "
                                      "press (2 messages)"));
}

TEST(DamagedMcap, NumbersOfAMessageAreKeptUpToTheLimitOnly) {
  SampleBudget budget("a.mcap", {});
  TopicOptions options;
  options.most_channels = 10;
  TopicSamples samples("t", options, &budget);
  const auto place = samples.field(TopicSamples::kMessage, 0, "x");
  // One place many times: neither places nor channels reach their limits, the numbers do.
  const auto add = [&](int count) {
    for (int i = 0; i < count; ++i) samples.add(place, i);
  };
  add(11);
  EXPECT_TRUE(samples.crowded());
  samples.drop();  // a damaged message says nothing about the topic
  add(10);
  samples.keep();
  EXPECT_FALSE(samples.overfull());
  add(11);
  samples.keep();
  EXPECT_TRUE(samples.overfull());
}

TEST(DamagedMcap, ACrowdedMessageThatIsDamagedLeavesItsTopicToTheOthers) {
  // 40 lists of 40 bytes are 1600 numbers, more than a topic may have
  CdrMessage m;
  m.put(std::uint32_t{40});
  for (int i = 0; i < 40; ++i) m.put(std::vector<std::uint8_t>(40, 7));
  const std::string cut = m.bytes().substr(0, m.bytes().size() - 1);
  const auto bag = [&](const std::string& crowded) {
    return read_recording(
        McapWriter()
            .add(bag_records())
            .add(McapWriter::schema(3, "a/msg/B", "ros2msg", "P[] p\n===\nMSG: a/P\nuint8[] x\n"))
            .add(McapWriter::channel(3, 3, "/b", "cdr"))
            .add(McapWriter::message(3, ns_at(0), 0, crowded))
            .add(McapWriter::message(
                3, ns_at(0.1), 0,
                CdrMessage().put(std::uint32_t{1}).put(std::vector<std::uint8_t>{5}).bytes()))
            .finished(),
        "a.mcap");
  };
  const Recording damaged = bag(cut);
  ASSERT_NE(find_channel(damaged, "/b.p[0].x[0]"), nullptr);
  EXPECT_THAT(damaged.warnings, ElementsAre(HasSubstr("1 of /b (2 messages)")));
  const Recording whole = bag(m.bytes());
  EXPECT_EQ(find_channel(whole, "/b.p[0].x[0]"), nullptr);
  EXPECT_THAT(whole.warnings,
              ElementsAre("left out, messages with more than 1000 numbers: /b (2 messages)"));
}

TEST(DamagedMcap, ADescriptionIsQuotedWithoutItsControlCharacters) {
  McapWriter w;
  w.add(bag_records());
  w.add(McapWriter::schema(3, "a/msg/B", "ros2msg", "float64[3\x1b x\n"));
  w.add(McapWriter::channel(3, 3, "/b", "cdr"));
  EXPECT_THAT(read_recording(w.finished(), "a.mcap").warnings,
              Contains(HasSubstr("got \"float64[3?\", expected ]")));
}

TEST(DamagedMcap, AFileThatWasNotFinishedIsReadUpToItsLastWholeRecord) {
  const std::string file = McapWriter().add(bag_records()).unfinished();
  const std::string last =
      McapWriter::message(1, 0, 0, test::joint_state({0, {"boom", "arm"}, {1, 2}, {1, 2}, {}}));
  for (const std::size_t cut : {std::size_t{1}, std::size_t{20}, last.size() - 1}) {
    const Recording r = read_recording(file.substr(0, file.size() - cut), "a.mcap");
    EXPECT_THAT(find_channel(r, "/joint_states.position[boom]")->values, SizeIs(39));
    EXPECT_THAT(r.warnings,
                ElementsAre(HasSubstr(fmt::format(
                    "not finished by its writer; it is read up to its last whole record, and {} "
                    "bytes behind that are left out",
                    last.size() - cut))));
  }
  // what a file system leaves where a recorder was killed
  const Recording zeros = read_recording(file + std::string(1000, '\0'), "a.mcap");
  EXPECT_THAT(find_channel(zeros, "/joint_states.position[boom]")->values, SizeIs(40));
  EXPECT_THAT(zeros.warnings, ElementsAre(HasSubstr("1000 bytes")));
  // a chunk that is not whole is left out as a whole
  const std::string chunks = McapWriter()
                                 .add(McapWriter::chunk(bag_records(), {"zstd"}))
                                 .add(McapWriter::chunk(bag_records(), {"zstd"}))
                                 .unfinished();
  const Recording r = read_recording(chunks.substr(0, chunks.size() - 5), "a.mcap");
  EXPECT_THAT(find_channel(r, "/joint_states.position[boom]")->values, SizeIs(40));
}

std::string mcap_error(const std::string& file, DoorLimits limits = {}) {
  RecordingOptions options;
  options.limits = limits;
  try {
    read_recording(file, "a.mcap", options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(DamagedMcap, DamageIsNamedWithByteAndRecord) {
  const std::string good = McapWriter().add(McapWriter::chunk(bag_records(), {"zstd"})).finished();
  const std::size_t chunk = 8 + 9 + 16;  // behind the magic bytes and the header
  ASSERT_EQ(good[chunk], '\x06');
  std::string bad = good;
  bad[chunk + 9 + 24] = static_cast<char>(bad[chunk + 9 + 24] ^ 1);  // the checksum
  EXPECT_THAT(mcap_error(bad), testing::AllOf(HasSubstr("a.mcap: byte 33, Chunk: its records have "
                                                        "the checksum"),
                                              HasSubstr("copy it again")));
  bad = good;
  bad.replace(chunk + 9 + 16, 8, test::low_first(std::uint64_t{1} << 50U, 8));
  EXPECT_THAT(mcap_error(bad), HasSubstr("packed bytes cannot hold 1125899906842624"));
  bad = good;
  bad.replace(chunk + 1, 8, test::low_first(~std::uint64_t{0}, 8));
  EXPECT_THAT(mcap_error(bad), HasSubstr("byte 33, Chunk: a record of 18446744073709551615 bytes "
                                         "begins where"));
  bad = good;
  bad.replace(chunk + 9 + 28 + 4, 4, "gzip");
  EXPECT_THAT(mcap_error(bad), HasSubstr("compression \"gzip\", expected none, lz4 or zstd"));
  bad = good;
  bad[5] = '1';
  EXPECT_THAT(mcap_error(bad), HasSubstr("another version of MCAP than 0"));
  EXPECT_THAT(mcap_error(McapWriter().finished()), HasSubstr("no channel of numbers"));
  EXPECT_THAT(mcap_error(McapWriter().add(McapWriter::message(5, 0, 0, "")).finished()),
              HasSubstr("byte 33, Message: a message of channel 5, which no record before it"));
  const std::string nested = McapWriter::chunk(McapWriter::chunk(bag_records(), {""}), {""});
  EXPECT_THAT(mcap_error(McapWriter().add(nested).finished()),
              HasSubstr("byte 0, Chunk of the chunk at byte 33: a chunk inside a chunk"));
}

TEST(DamagedMcap, LimitsOfALogHold) {
  const std::string file = McapWriter().add(McapWriter::chunk(bag_records(), {"lz4"})).finished();
  DoorLimits limits;
  limits.log_bytes = 1000;
  EXPECT_THAT(mcap_error(file, limits), HasSubstr("are more than the 1000 that are left"));
  limits = {};
  limits.log_values = 400;
  EXPECT_THAT(mcap_error(file, limits), HasSubstr("more than 400 values and times"));
  limits = {};
  limits.log_columns = 4;
  EXPECT_THAT(mcap_error(file, limits), HasSubstr("more than 4 channels"));
}

TEST(DamagedMcap, HostileLengthsInMessagesAreLeftOut) {
  const auto file = [](const std::string& description, const std::string& message) {
    return McapWriter()
        .add(bag_records())
        .add(McapWriter::schema(3, "a/msg/B", "ros2msg", description))
        .add(McapWriter::channel(3, 3, "/b", "cdr"))
        .add(McapWriter::message(3, ns_at(0), 0, message))
        .finished();
  };
  const std::string most = CdrMessage().put(~std::uint32_t{0}).bytes();
  const std::string twice =
      "float64 x\nC c\n=====\nMSG: a/C\nD[1000000000] a\nD[1000000000] b\n"
      "=====\nMSG: a/D\nuint8[1000000000] d\n";
  for (const std::string& description :
       {std::string("float64[] x\n"), std::string("string s\nfloat64 x\n"), twice,
        std::string("string[] name\nfloat64[] x\n"), std::string("uint8[4000000000] x\n")}) {
    SCOPED_TRACE(description);
    const Recording r = read_recording(file(description, most), "a.mcap");
    EXPECT_THAT(r.channels, SizeIs(5));
    EXPECT_THAT(r.warnings, Contains(HasSubstr("end before their description does: 1 of /b")));
  }
  // a type that holds its successor twice, thirty times over, describes a billion numbers
  std::string wide = "T0 t\n";
  for (int i = 0; i < 30; ++i)
    wide += fmt::format("====\nMSG: a/T{}\nT{} l\nT{} r\n", i, i + 1, i + 1);
  wide += "====\nMSG: a/T30\nuint8 x\n";
  const std::string bytes = std::string("\0\1\0\0", 4) + std::string(5000, '\1');
  EXPECT_THAT(read_recording(file(wide, bytes), "a.mcap").channels, SizeIs(5));
  EXPECT_THAT(
      read_recording(file("uint8[60] x\nP[60] p\n===\nMSG: a/P\nuint8[60] y\n", bytes), "a.mcap")
          .warnings,
      Contains(HasSubstr("messages with more than 1000 numbers: /b")));
  // points in points in points: more places than a topic may have, in one message
  const std::string deep =
      "P[] a\n===\nMSG: a/P\nQ[] b\n===\nMSG: a/Q\nR[] c\n===\nMSG: a/R\nuint8 x\n";
  CdrMessage cube;
  cube.put(std::uint32_t{40});
  for (int i = 0; i < 40; ++i) {
    cube.put(std::uint32_t{40});
    for (int k = 0; k < 40; ++k) cube.put(std::vector<std::uint8_t>(40, 1));
  }
  const Recording r = read_recording(file(deep, cube.bytes()), "a.mcap");
  EXPECT_THAT(r.channels, SizeIs(5));
  EXPECT_THAT(r.warnings, Contains(HasSubstr("messages with more than 1000 numbers: /b")));
}

TEST(DamagedMcap, ThreeThousandChangedFilesAreReadOrRefused) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return random() % n; };
  const std::string mixed_records =
      McapWriter::schema(9, "my_msgs/msg/Mixed", "ros2msg", test::kMixed) +
      McapWriter::channel(3, 9, "m", "cdr") +
      McapWriter::message(3, ns_at(0), 0, test::mixed(false, 3, 5)) +
      McapWriter::message(3, ns_at(1), 0, test::mixed(true, 1, 100)) +
      McapWriter::channel(4, 0, "j", "json") +
      McapWriter::message(4, ns_at(1), 0, R"({"a":[1,2]})");
  std::vector<std::string> files = {
      McapWriter().add(bag_records()).finished(), McapWriter().add(mixed_records).finished(),
      McapWriter().add(mixed_records).add(bag_records(true)).unfinished()};
  for (const char* name : {"", "lz4", "zstd"})
    files.push_back(McapWriter().add(McapWriter::chunk(mixed_records, {name, false})).finished());
  int refused = 0;
  for (std::size_t k = 0; k < 3000; ++k) {
    std::string file = files[k % files.size()];
    for (std::size_t e = 1 + below(4); e > 0; --e) {
      const std::size_t place = 8 + below(file.size() - 16);
      if (below(3) == 0) {
        file.replace(place, 4, test::low_first(below(2) == 0 ? below(300) : ~0ULL >> below(40), 4));
      } else {
        file[place] = static_cast<char>(below(256));
      }
    }
    RecordingOptions options;
    options.limits.log_bytes = 10'000'000, options.limits.log_values = 100'000;
    try {
      const Recording r = read_recording(file, "a.mcap", options);
      for (const RecordedChannel& c : r.channels) {
        ASSERT_EQ(c.time.size(), c.values.size());
        ASSERT_TRUE(std::is_sorted(c.time.begin(), c.time.end()));
      }
    } catch (const InputError&) {
      ++refused;
    }
  }
  // Lengths and opcodes are a fifth of the bytes of these files; most other changes are values.
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace sparflow
