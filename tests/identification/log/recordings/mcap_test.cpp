/// MCAP files written by an encoder of their own, and read back.
#include "identification/log/recordings/mcap/mcap.h"

#include <gmock/gmock.h>

#include "identification/log/recordings/mcap/topic_samples.h"
#include "tests/identification/log/recordings/mcap_bags.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::bag_records;
using test::CdrMessage;
using test::find_channel;
using test::JointStates;
using test::kDelay;
using test::kMixed;
using test::McapWriter;
using test::mixed;
using test::ns_at;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

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

}  // namespace
}  // namespace sparflow
