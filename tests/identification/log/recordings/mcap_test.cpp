/// MCAP files written by an encoder of their own, and read back; and damaged ones.
#include "identification/log/recordings/mcap/mcap.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "identification/log/recordings/mcap/topic_samples.h"
#include "models/math/error.h"
#include "tests/identification/log/recordings/mcap_writer.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::CdrMessage;
using test::JointStates;
using test::McapCompression;
using test::McapWriter;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::uint64_t kSecond = 1'000'000'000, kEpoch = 1'700'000'000 * kSecond;
constexpr std::uint64_t kDelay = 3'000'000;  // from the stamp to the recorder [ns]

std::uint64_t ns_at(double seconds) {
  return kEpoch + static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

const RecordedChannel* find_channel(const Recording& r, const std::string& name) {
  for (const RecordedChannel& c : r.channels)
    if (c.name == name) return &c;
  return nullptr;
}

/// 40 messages of two joints at 100 Hz whose order is turned in every second one, and a pressure at 10 Hz without header.
std::string bag_records(bool big = false) {
  std::string all = McapWriter::schema(1, "sensor_msgs/msg/JointState", "ros2msg",
                                       test::joint_state_description()) +
                    McapWriter::channel(1, 1, "/joint_states", "cdr") +
                    McapWriter::schema(2, "std_msgs/msg/Float64", "ros2msg", "float64 data\n") +
                    McapWriter::channel(2, 2, "/pump", "cdr");
  for (int i = 0; i < 40; ++i) {
    const double t = 0.01 * i;
    JointStates joints{1.7e9 + t, {"boom", "arm"}, {0.1 * i, -0.2 * i}, {1.0, 2.0 + i}, {}};
    if (i % 2 == 1) {
      std::swap(joints.names[0], joints.names[1]);
      std::swap(joints.position[0], joints.position[1]);
      std::swap(joints.velocity[0], joints.velocity[1]);
    }
    all += McapWriter::message(1, ns_at(t) + kDelay, ns_at(t) + kDelay,
                               test::joint_state(joints, big));
    if (i % 10 == 0) {
      all += McapWriter::message(2, ns_at(t) + kDelay, ns_at(t),
                                 CdrMessage(big).put(200.0 + i).bytes());
    }
  }
  return all;
}

void expect_joints(const Recording& r) {
  ASSERT_THAT(r.channels, SizeIs(5));
  EXPECT_THAT(r.warnings, IsEmpty());
  const RecordedChannel* boom = find_channel(r, "/joint_states.position[boom]");
  const RecordedChannel* arm = find_channel(r, "/joint_states.velocity[arm]");
  const RecordedChannel* pump = find_channel(r, "/pump.data");
  ASSERT_TRUE(boom != nullptr && arm != nullptr && pump != nullptr);
  ASSERT_THAT(boom->values, SizeIs(40));
  ASSERT_THAT(arm->values, SizeIs(40));
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_DOUBLE_EQ(boom->values[i], 0.1 * static_cast<double>(i));
    EXPECT_DOUBLE_EQ(arm->values[i], 2.0 + static_cast<double>(i));
    // the stamp itself is a double of 1.7e9 s, which has 2.4e-7 s
    EXPECT_NEAR(boom->time[i], 0.01 * static_cast<double>(i), 3e-7);
  }
  EXPECT_THAT(pump->values, ElementsAre(200, 210, 220, 230));
  EXPECT_NEAR(pump->time[3], 0.3, 3e-7);
  EXPECT_EQ(boom->group, "/joint_states");
  EXPECT_EQ(boom->comment, "sensor_msgs/msg/JointState, time: header.stamp");
  EXPECT_EQ(pump->comment, "std_msgs/msg/Float64, time: the time of publication");
}

TEST(Mcap, EveryCompressionGivesTheSameValues) {
  for (const bool big : {false, true}) {
    SCOPED_TRACE(big ? "big-endian" : "little-endian");
    expect_joints(read_recording(McapWriter().add(bag_records(big)).finished(), "a.mcap"));
    for (const char* name : {"", "lz4", "zstd"}) {
      for (const bool crc : {false, true}) {
        SCOPED_TRACE(name);
        const auto chunk = McapWriter::chunk(bag_records(big), {name, crc});
        expect_joints(read_recording(McapWriter().add(chunk).finished(), "a.mcap"));
      }
    }
  }
}

TEST(Mcap, FormatNamesTopicsMessagesAndTimes) {
  const Recording r = read_recording(McapWriter().add(bag_records()).finished(), "a.mcap");
  EXPECT_EQ(r.format,
            "MCAP (ros2), 2 topics, 44 messages; time: header.stamp of 1 topic, the time of "
            "publication of 1 topic");
}

TEST(Mcap, SchemasChannelsAndMessagesMayStandInDifferentChunks) {
  const std::string all = bag_records();
  const std::string first =
      all.substr(0, all.find(McapWriter::message(1, ns_at(0) + kDelay, 0, "").substr(9, 14)) - 9);
  const std::string file = McapWriter()
                               .add(McapWriter::chunk(first, {"lz4"}))
                               .add(McapWriter::record(0x07, std::string(20, '\1')))  // an index
                               .add(McapWriter::chunk(all.substr(first.size()), {"zstd"}))
                               .finished();
  expect_joints(read_recording(file, "a.mcap"));
}

/// A type with every kind of field; the alignment of each is that of its number.
const char* const kMixed =
    "uint8 MODE_OFF=0\nstring NAME = \"a # b\"\nbool on\nfloat64 wide   # [bar]\nbyte raw\n"
    "int16[3] three\nstring<=10 label \"none\"\nint32[<=4] few\nfloat32 half -0.5\n"
    "other_msgs/Point[] path\nPart part\nint64 big\nchar letter\nuint64[2] counts\n"
    "builtin_interfaces/Duration span\nuint16[] pixels\n"
    "=========================\nMSG: other_msgs/msg/Point\nint8 x\nfloat64 y\n"
    "=========================\nMSG: my_msgs/Part\nEmpty nothing\nuint32 u\nuint16 v\n"
    "=========================\nMSG: my_msgs/Empty\n";

std::string mixed(bool big, std::size_t path, std::size_t pixels) {
  CdrMessage m(big);
  m.put(std::uint8_t{1}).put(-12.5).put(std::uint8_t{255});
  for (const int v : {-1, 2, -3}) m.put(static_cast<std::int16_t>(v));
  m.put(std::string("odd")).put(std::vector<std::int32_t>{7, -8}).put(-0.25F);
  m.put(static_cast<std::uint32_t>(path));
  for (std::size_t i = 0; i < path; ++i)
    m.put(static_cast<std::int8_t>(-5 - static_cast<int>(i))).put(1.5 * static_cast<double>(i));
  m.put(std::uint8_t{0}).put(std::uint32_t{4'000'000'000}).put(std::uint16_t{65535});
  m.put(std::int64_t{-9'000'000'000}).put(std::uint8_t{'z'});
  m.put(std::uint64_t{1} << 40U).put(std::uint64_t{3});
  m.put(std::int32_t{-2}).put(std::uint32_t{500'000'000});
  return m.put(std::vector<std::uint16_t>(pixels, 9)).bytes();
}

TEST(Mcap, EveryKindOfFieldHasItsValue) {
  for (const bool big : {false, true}) {
    SCOPED_TRACE(big);
    const std::string file = McapWriter()
                                 .add(McapWriter::schema(9, "my_msgs/msg/Mixed", "ros2msg", kMixed))
                                 .add(McapWriter::channel(3, 9, "m", "cdr"))
                                 .add(McapWriter::message(3, ns_at(0), 0, mixed(big, 2, 0)))
                                 .add(McapWriter::message(3, ns_at(1), 0, mixed(big, 1, 100)))
                                 .finished();
    const Recording r = read_recording(file, "a.mcap");
    const std::vector<std::pair<std::string, double>> expected = {
        {"m.on", 1},          {"m.wide", -12.5},  {"m.raw", 255},
        {"m.three[0]", -1},   {"m.three[1]", 2},  {"m.three[2]", -3},
        {"m.few[0]", 7},      {"m.few[1]", -8},   {"m.half", -0.25},
        {"m.path[0].x", -5},  {"m.path[0].y", 0}, {"m.path[1].x", -6},
        {"m.path[1].y", 1.5}, {"m.part.u", 4e9},  {"m.part.v", 65535},
        {"m.big", -9e9},      {"m.letter", 122},  {"m.counts[0]", 1099511627776.0},
        {"m.counts[1]", 3},   {"m.span", -1.5}};
    EXPECT_THAT(r.channels, SizeIs(expected.size()));
    for (const auto& [name, value] : expected) {
      const RecordedChannel* c = find_channel(r, name);
      ASSERT_NE(c, nullptr) << name;
      EXPECT_EQ(c->values[0], value) << name;
      // The second message has one point only, and its channels end there.
      EXPECT_THAT(c->values, SizeIs(name.starts_with("m.path[1]") ? 1 : 2)) << name;
    }
    EXPECT_EQ(find_channel(r, "m.span")->unit, "s");
    EXPECT_THAT(r.warnings, ElementsAre("left out, sequences of more than 64 elements: m.pixels"));
  }
}

TEST(Mcap, NamesThatDoNotFitGiveWayToNumbersAndARepeatedNameCountsOnce) {
  const auto bag = [](const JointStates& joints) {
    return McapWriter()
        .add(McapWriter::schema(1, "sensor_msgs/msg/JointState", "ros2msg",
                                test::joint_state_description()))
        .add(McapWriter::channel(1, 1, "/j", "cdr"))
        .add(McapWriter::message(1, ns_at(0), 0, test::joint_state(joints)))
        .finished();
  };
  const Recording fewer = read_recording(bag({1.7e9, {"a"}, {5, 6}, {}, {7}}), "a.mcap");
  ASSERT_THAT(fewer.channels, SizeIs(3));
  EXPECT_EQ(find_channel(fewer, "/j.position[1]")->values[0], 6);
  EXPECT_EQ(find_channel(fewer, "/j.effort[a]")->values[0], 7);
  const Recording more = read_recording(bag({1.7e9, {"a", "b"}, {5}, {}, {}}), "a.mcap");
  EXPECT_EQ(find_channel(more, "/j.position[0]")->values[0], 5);
  // Of 100 names 64 are kept; that they are as many as the positions is chance.
  std::vector<std::string> many(100);
  for (std::size_t i = 0; i < many.size(); ++i) many[i] = fmt::format("n{}", i);
  const Recording beside = read_recording(
      bag({1.7e9, many, std::vector<double>(TopicOptions{}.longest_sequence, 5), {}, {}}),
      "a.mcap");
  EXPECT_NE(find_channel(beside, "/j.position[0]"), nullptr);
  EXPECT_EQ(find_channel(beside, "/j.position[n0]"), nullptr);
  const Recording twice = read_recording(bag({1.7e9, {"a", "a"}, {5, 6}, {}, {}}), "a.mcap");
  ASSERT_THAT(twice.channels, SizeIs(1));
  EXPECT_THAT(twice.channels[0].values, ElementsAre(5));
  EXPECT_THAT(twice.warnings,
              ElementsAre("left out, values of a name that a message has twice: 1 of /j"));
}

TEST(Mcap, WhatStandsBehindALongSequenceIsRead) {
  // 65 elements, each with an empty sequence of numbers of eight bytes, which need no padding when there are none
  CdrMessage m;
  m.put(3.0F).put(std::uint32_t{65});
  for (int i = 0; i < 65; ++i) m.put(std::vector<double>{}).put(std::uint16_t{7});
  m.put(std::vector<double>(100, 1.0)).put(42.0F);
  const std::string file =
      McapWriter()
          .add(McapWriter::schema(
              1, "a/msg/B", "ros2msg",
              "float32 first\nP[] p\nfloat64[] q\nfloat32 last\n===\nMSG: a/P\nfloat64[] "
              "x\nuint16 y\n"))
          .add(McapWriter::channel(1, 1, "b", "cdr"))
          .add(McapWriter::message(1, ns_at(0), 0, m.bytes()))
          .finished();
  const Recording r = read_recording(file, "a.mcap");
  ASSERT_THAT(r.channels, SizeIs(2));
  EXPECT_EQ(r.channels[1].name, "b.last");
  EXPECT_EQ(r.channels[1].values[0], 42);
  EXPECT_THAT(r.warnings, ElementsAre("left out, sequences of more than 64 elements: b.p, b.q"));
}

TEST(Mcap, PublishersOfATopicAreOneAndOutOfOrderMessagesAreSorted) {
  const auto value = [](double v) { return CdrMessage().put(v).bytes(); };
  const std::string file =
      McapWriter()
          .add(McapWriter::schema(1, "std_msgs/msg/Float64", "ros2msg", "float64 data"))
          .add(McapWriter::channel(1, 1, "/q", "cdr"))
          .add(McapWriter::channel(2, 1, "/q", "cdr"))
          .add(McapWriter::message(1, ns_at(2), 0, value(3)))
          .add(McapWriter::message(2, ns_at(0), 0, value(1)))
          .add(McapWriter::message(1, ns_at(1), 0, value(2)))
          .finished();
  const Recording r = read_recording(file, "a.mcap");
  ASSERT_THAT(r.channels, SizeIs(1));
  EXPECT_THAT(r.channels[0].values, ElementsAre(1, 2, 3));
  EXPECT_THAT(r.channels[0].time, ElementsAre(0, 1, 2));
}

/// Two messages of a topic with a header, and of one without, which were recorded at 0 s and 1 s.
std::string stamped_bag(double first, double second, bool with_other) {
  McapWriter w;
  w.add(McapWriter::schema(1, "sensor_msgs/msg/JointState", "ros2msg",
                           test::joint_state_description()));
  w.add(McapWriter::channel(1, 1, "/j", "cdr"));
  if (with_other) {
    w.add(McapWriter::schema(2, "std_msgs/msg/Int8", "ros2msg", "int8 data"));
    w.add(McapWriter::channel(2, 2, "/i", "cdr"));
    w.add(McapWriter::message(2, ns_at(0), 0, CdrMessage().put(std::int8_t{-3}).bytes()));
  }
  w.add(McapWriter::message(1, ns_at(0), ns_at(0), test::joint_state({first, {"a"}, {1}, {}, {}})));
  w.add(
      McapWriter::message(1, ns_at(1), ns_at(1), test::joint_state({second, {"a"}, {2}, {}, {}})));
  return w.finished();
}

TEST(Mcap, StampsOfAnotherClockGiveWayToTheRecorders) {
  // A simulation's clock begins at zero: alone it is the time, beside a topic without stamps it is not.
  const Recording alone = read_recording(stamped_bag(5.0, 5.5, false), "a.mcap");
  EXPECT_THAT(alone.channels[0].time, ElementsAre(0, 0.5));
  EXPECT_THAT(alone.warnings, IsEmpty());
  const Recording both = read_recording(stamped_bag(5.0, 5.5, true), "a.mcap");
  EXPECT_THAT(find_channel(both, "/j.position[a]")->time, ElementsAre(0, 1));
  EXPECT_THAT(both.warnings,
              ElementsAre(HasSubstr("/j: the time of publication is taken, their stamps lie "
                                    "-1.7e+09 s from the times of recording")));
  const Recording zero = read_recording(stamped_bag(0.0, 5.5, false), "a.mcap");
  EXPECT_THAT(zero.channels[0].time, ElementsAre(0, 1));
  EXPECT_THAT(zero.warnings, ElementsAre(HasSubstr("some of their stamps are zero or missing")));
}

TEST(Mcap, JsonMessagesOfNumbersAreRead) {
  const std::string file =
      McapWriter()
          .add(McapWriter::channel(4, 0, "press", "json"))
          .add(McapWriter::message(
              4, ns_at(0.1), 0,
              R"({"header":{"stamp":{"sec":1700000000,"nanosec":0}},"p":[1.5,2],"on":true,"who":"x"})"))
          .add(McapWriter::message(
              4, ns_at(0.6), 0,
              R"({"header":{"stamp":{"sec":1700000000,"nanosec":500000000}},"p":[3,4],"on":false})"))
          .add(McapWriter::message(4, ns_at(0.7), 0, "[1"))
          .finished();
  const Recording r = read_recording(file, "a.mcap");
  ASSERT_THAT(r.channels, SizeIs(3));
  EXPECT_THAT(find_channel(r, "press.p[1]")->values, ElementsAre(2, 4));
  EXPECT_THAT(find_channel(r, "press.p[1]")->time, ElementsAre(0, 0.5));
  EXPECT_THAT(find_channel(r, "press.on")->values, ElementsAre(1, 0));
  EXPECT_THAT(r.warnings,
              ElementsAre("left out, messages that are no JSON object, or one nested more "
                          "than 64 deep: 1 of press (3 messages)"));
}

TEST(Mcap, AJsonMessageAboveTheLimitIsLeftOutBeforeItIsParsed) {
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

TEST(Mcap, NumbersOfAMessageAreKeptUpToTheLimitOnly) {
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

TEST(Mcap, ACrowdedMessageThatIsDamagedLeavesItsTopicToTheOthers) {
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

TEST(Mcap, ADescriptionIsQuotedWithoutItsControlCharacters) {
  McapWriter w;
  w.add(bag_records());
  w.add(McapWriter::schema(3, "a/msg/B", "ros2msg", "float64[3\x1b x\n"));
  w.add(McapWriter::channel(3, 3, "/b", "cdr"));
  EXPECT_THAT(read_recording(w.finished(), "a.mcap").warnings,
              Contains(HasSubstr("got \"float64[3?\", expected ]")));
}

TEST(Mcap, WhatIsNotReadIsNamedWithItsReason) {
  McapWriter w;
  w.add(bag_records());
  w.add(McapWriter::schema(3, "a/B", "protobuf", "x"));
  w.add(McapWriter::channel(3, 3, "/camera", "protobuf"));
  w.add(McapWriter::message(3, ns_at(0), 0, "abc"));
  w.add(McapWriter::schema(4, "a/msg/C", "ros2idl", "x"));
  w.add(McapWriter::channel(4, 4, "/idl", "cdr"));
  w.add(McapWriter::schema(5, "a/msg/D", "ros2msg", "float64 x\nmissing_msgs/E e\n"));
  w.add(McapWriter::channel(5, 5, "/d", "cdr"));
  w.add(McapWriter::schema(6, "a/msg/F", "ros2msg", "F again\n"));
  w.add(McapWriter::channel(6, 6, "/f", "cdr"));
  w.add(McapWriter::schema(7, "std_msgs/msg/String", "ros2msg", "string data"));
  w.add(McapWriter::channel(7, 7, "/text", "cdr"));
  w.add(McapWriter::channel(8, 2, "/silent", "cdr"));
  w.add(McapWriter::channel(9, 2, "/cut", "cdr"));
  w.add(McapWriter::message(9, ns_at(0), 0, CdrMessage().put(1.0F).bytes()));
  w.add(McapWriter::channel(10, 2, "/pl", "cdr"));
  w.add(McapWriter::message(10, ns_at(0), 0, std::string("\0\3\0\0", 4) + std::string(8, '\0')));
  w.add(McapWriter::channel(11, 2, "/long", "cdr"));
  w.add(McapWriter::message(11, ns_at(0), 0, CdrMessage().put(1.0).put(1.0).bytes()));
  const Recording r = read_recording(w.finished(), "a.mcap");
  EXPECT_THAT(r.channels, SizeIs(6));  // those of bag_records() and /long
  for (const char* sentence :
       {"messages in the encoding \"protobuf\", expected cdr or json: /camera (1 messages)",
        "messages described by \"ros2idl\", expected ros2msg: /idl (0 messages)",
        "the description of a/msg/D is not understood (line 2: type missing_msgs/E is not "
        "described): /d (0 messages)",
        "(line 1: type a/F contains itself): /f", "messages without numbers: /text",
        "topics without messages: /silent",
        "messages that end before their description does: 1 of /cut (1 messages)",
        "messages that are not CDR of version 1: 1 of /pl",
        "/long: 1 messages are longer than their description"}) {
    EXPECT_THAT(r.warnings, Contains(HasSubstr(sentence)));
  }
}

TEST(Mcap, AFileThatWasNotFinishedIsReadUpToItsLastWholeRecord) {
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

TEST(Mcap, DamageIsNamedWithByteAndRecord) {
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

TEST(Mcap, LimitsOfALogHold) {
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

TEST(Mcap, HostileLengthsInMessagesAreLeftOut) {
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

class McapLog : public test::LogFiles {};

TEST_F(McapLog, ABagIsALogByAMappingFile) {
  const std::string bag = write("a.mcap", McapWriter().add(bag_records()).finished());
  LogOptions options;
  options.mapping_file =
      write("m.yaml",
            "columns:\n  q_boom_rad: \"`/joint_states.position[boom]` * 0.1\"\n"
            "  q_extension_m: \"0 - /joint_states.position[arm]\"\n  p_pump_bar: /pump.data\n");
  const Log log = load_log(bag, test::small_crane(), options);
  // The joint states are four of five channels, and their stamps the clock.
  ASSERT_EQ(log.samples(), 40);
  EXPECT_NEAR(log.time[39] - log.time[0], 0.39, 3e-7);
  const Channel* extension = log.find(Role::kJointPosition, 1);
  ASSERT_NE(extension, nullptr);
  EXPECT_NEAR(extension->values[20], 4.0, 1e-12);
  // a clock of its own
  options.mapping_file = write("c.yaml",
                               "clock_s: 0.03\ncolumns:\n"
                               "  q_boom_rad: \"/joint_states.position[boom] * 0.1\"\n"
                               "  q_extension_m: \"0 - /joint_states.position[arm]\"\n");
  const Log slow = load_log(bag, test::small_crane(), options);
  ASSERT_EQ(slow.samples(), 14);  // 0 s to 0.39 s
  EXPECT_NEAR(slow.time[1] - slow.time[0], 0.03, 1e-12);
  options.mapping_file = write("d.yaml", "clock_s: -1\n");
  EXPECT_THAT(message_of([&] { load_log(bag, test::small_crane(), options); }),
              HasSubstr("d.yaml:1:10: clock_s: expected the time between two rows"));
}

TEST(Mcap, ThreeThousandChangedFilesAreReadOrRefused) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return random() % n; };
  const std::string mixed_records = McapWriter::schema(9, "my_msgs/msg/Mixed", "ros2msg", kMixed) +
                                    McapWriter::channel(3, 9, "m", "cdr") +
                                    McapWriter::message(3, ns_at(0), 0, mixed(false, 3, 5)) +
                                    McapWriter::message(3, ns_at(1), 0, mixed(true, 1, 100)) +
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
