#pragma once
/// Makes channels of the numbers in the messages of one topic: `topic.field.sub`, `topic.field[3]`, `topic.position[boom]`.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "identification/log/recordings/recording.h"
#include "models/math/door.h"

namespace sparflow {

struct TopicOptions {
  /// Longest sequence whose elements become channels; longer ones are images, clouds of points and maps.
  /// @threshold [1] 8..1000; chosen: no machine has more joints, and a covariance of six axes has 36
  std::size_t longest_sequence = 64;
  /// Largest number of channels of a topic; a topic with more is left out.
  /// @threshold [1] 100..1e4; chosen: joint states of a hundred joints have 300; drawings have more
  std::size_t most_channels = 1000;
  /// Largest message in JSON that is read.
  /// @threshold [byte] 1e5..1e8; chosen: a thousand numbers take 50 kB, and a text takes up to sixteen times its size in memory
  std::size_t longest_json = 4'000'000;
};

/// What all topics of a file may hold together.
class SampleBudget {
 public:
  SampleBudget(std::string file, const DoorLimits& limits)
      : file_(std::move(file)), limits_(limits) {}
  /// @throws InputError where the file has more than a log may have
  void add_values(std::int64_t count);
  void add_channel();
  void add_place();
  void free(std::int64_t channels, std::int64_t places, std::int64_t values) {
    channels_ -= channels, places_ -= places, values_ -= values;
  }

 private:
  [[noreturn]] void fail(std::int64_t limit, const char* what) const;
  std::string file_;
  DoorLimits limits_;
  std::int64_t channels_ = 0, places_ = 0, values_ = 0;
};

class TopicSamples {
 public:
  /// A place in the structure of the messages; places are made when a message first has them.
  using Place = std::uint32_t;
  static constexpr Place kMessage = 0;  ///< the whole message

  TopicSamples(const std::string& topic, const TopicOptions& options, SampleBudget* budget);

  /// Places inside another; `index` is where it stood in the last messages, which makes finding it fast.
  Place field(Place of, std::size_t index, std::string_view name);  ///< "of.name"
  Place named(Place of, std::size_t index, std::string_view name);  ///< "of[name]"
  Place element(Place of, std::size_t index);                       ///< "of[index]"
  void set_unit(Place place, const char* unit) { places_[place].unit = unit; }

  /// A number of the present message; it counts when `keep` follows.
  void add(Place place, double value) {
    if (pending_.size() >= options_.most_channels) crowded_ = true;
    if (!crowded_) pending_.emplace_back(place, value);
  }
  void keep();
  void drop() {
    pending_.clear();
    crowded_ = false;
  }
  /// The present message has more numbers or parts than a topic may have; what follows in it is of no use.
  bool crowded() const { return crowded_; }

  std::size_t messages() const { return messages_; }
  bool has_channels() const { return !leaves_.empty(); }
  /// The topic has too many channels; what it had is freed and nothing more is kept.
  bool overfull() const { return overfull_; }
  std::int64_t repeated() const {
    return repeated_;
  }  ///< values of a name that a message has twice

  /// Appends the channels, sorted by time. @param time [s] of each message that was kept
  /// @param like group and comment of the channels
  void finish(const std::vector<double>& time, const RecordedChannel& like, Recording* recording);

 private:
  static constexpr std::size_t kNoNumber = static_cast<std::size_t>(-1);
  struct Node {
    std::string name, key;
    std::size_t number = kNoNumber;  ///< of an element that has no name
    const char* unit = "";
    std::vector<Place> last;                           ///< places inside, by their index
    std::map<std::string, Place, std::less<>> inside;  ///< the same by their key
    std::int32_t leaf = -1;
  };
  struct Leaf {
    Place place = 0;
    std::vector<std::uint32_t> message;
    std::vector<double> values;
  };
  enum class Kind : std::uint8_t { kField, kNamed };
  Place inside(Place of, std::size_t index, std::string_view key, Kind kind);
  void give_up();

  TopicOptions options_;
  SampleBudget* budget_;
  std::vector<Node> places_;
  std::vector<Leaf> leaves_;
  std::vector<std::pair<Place, double>> pending_;
  std::size_t messages_ = 0;
  std::int64_t values_ = 0, repeated_ = 0;
  bool overfull_ = false, crowded_ = false;
};

}  // namespace sparflow
