#include "identification/log/recordings/mcap/topic_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "models/math/error.h"
#include "models/math/nan.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

/// Places of a structure, over the channels that may come of them; a topic with more counts as one with too many channels.
/// @threshold [1] 2..100; chosen: structures nest, and each channel lies at the end of a few places
constexpr std::size_t kPlacesOfChannel = 10;
/// Longest name of an element that is told apart from others.
/// @threshold [byte] 50..1000; chosen: that of a quotation, longer ones are cut in messages as well
constexpr std::size_t kLongestKey = 200;

}  // namespace

void SampleBudget::fail(std::int64_t limit, const char* what) const {
  throw InputError({file_, 0, 0}, "",
                   fmt::format("more than {:g} {}, the limit of a log (docs/limits.md); record "
                               "fewer topics, or cut the recording into shorter files",
                               static_cast<double>(limit), what));
}

void SampleBudget::add_values(std::int64_t count) {
  values_ += count;
  if (values_ > limits_.log_values) fail(limits_.log_values, "values and times in the file");
}

void SampleBudget::add_channel() {
  if (++channels_ > limits_.log_columns) fail(limits_.log_columns, "channels in the file");
}

void SampleBudget::add_place() {
  const std::int64_t most = static_cast<std::int64_t>(kPlacesOfChannel) * limits_.log_columns;
  if (++places_ > most) fail(most, "parts of messages in the file");
}

TopicSamples::TopicSamples(const std::string& topic, const TopicOptions& options,
                           SampleBudget* budget)
    : options_(options), budget_(budget) {
  budget_->add_place();
  places_.emplace_back().name = topic;
}

TopicSamples::Place TopicSamples::field(Place of, std::size_t index, std::string_view name) {
  return inside(of, index, name, Kind::kField);
}

TopicSamples::Place TopicSamples::named(Place of, std::size_t index, std::string_view name) {
  return inside(of, index, name, Kind::kNamed);
}

TopicSamples::Place TopicSamples::element(Place of, std::size_t index) {
  const std::vector<Place>& last = places_[of].last;
  if (index < last.size() && last[index] != 0 && places_[last[index]].number == index)
    return last[index];
  const Place place = inside(of, index, fmt::format("{}", index), Kind::kNamed);
  places_[place].number = index;
  return place;
}

TopicSamples::Place TopicSamples::inside(Place of, std::size_t index, std::string_view key,
                                         Kind kind) {
  key = key.substr(0, kLongestKey);
  {
    const std::vector<Place>& last = places_[of].last;
    if (index < last.size() && last[index] != 0 && places_[last[index]].key == key)
      return last[index];
  }
  auto found = places_[of].inside.find(key);
  if (found == places_[of].inside.end()) {
    if (places_.size() >= kPlacesOfChannel * options_.most_channels) {
      crowded_ = true;  // the message is not kept, so that its numbers may stand anywhere
      return of;
    }
    budget_->add_place();
    Node node;
    node.key = key;
    const std::string shown = printable(key);
    node.name = kind == Kind::kField ? fmt::format("{}.{}", places_[of].name, shown)
                                     : fmt::format("{}[{}]", places_[of].name, shown);
    const auto place = static_cast<Place>(places_.size());
    places_.push_back(std::move(node));
    found = places_[of].inside.emplace(std::string(key), place).first;
  }
  std::vector<Place>& last = places_[of].last;
  if (last.size() <= index) last.resize(index + 1);
  last[index] = found->second;
  return found->second;
}

void TopicSamples::keep() {
  const auto message = static_cast<std::uint32_t>(messages_++);
  if (crowded_ && !overfull_) give_up();
  for (const auto& [place, value] : pending_) {
    if (overfull_) break;
    Node& node = places_[place];
    if (node.leaf < 0) {
      if (leaves_.size() >= options_.most_channels) {
        give_up();
        break;
      }
      budget_->add_channel();
      node.leaf = static_cast<std::int32_t>(leaves_.size());
      leaves_.emplace_back().place = place;
    }
    Leaf& leaf = leaves_[static_cast<std::size_t>(node.leaf)];
    if (!leaf.message.empty() && leaf.message.back() == message) {
      ++repeated_;
      continue;
    }
    budget_->add_values(2);
    values_ += 2;
    leaf.message.push_back(message);
    leaf.values.push_back(std::isfinite(value) ? value : kNaN);
  }
  pending_.clear();
}

void TopicSamples::give_up() {
  overfull_ = true;
  budget_->free(static_cast<std::int64_t>(leaves_.size()),
                static_cast<std::int64_t>(places_.size()) - 1, values_);
  leaves_ = {};
  places_ = {};
  places_.emplace_back();
}

void TopicSamples::finish(const std::vector<double>& time, const RecordedChannel& like,
                          Recording* recording) {
  for (Leaf& leaf : leaves_) {
    RecordedChannel channel;
    channel.name = places_[leaf.place].name;
    channel.unit = places_[leaf.place].unit;
    channel.group = like.group;
    channel.comment = like.comment;
    channel.time.reserve(leaf.message.size());
    for (const std::uint32_t message : leaf.message) channel.time.push_back(time[message]);
    leaf.message = {};
    channel.values = std::move(leaf.values);
    if (!std::is_sorted(channel.time.begin(), channel.time.end())) {
      std::vector<std::size_t> order(channel.time.size());
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return channel.time[a] < channel.time[b];
      });
      std::vector<double> times, values;
      times.reserve(order.size());
      values.reserve(order.size());
      for (const std::size_t i : order) {
        times.push_back(channel.time[i]);
        values.push_back(channel.values[i]);
      }
      channel.time = std::move(times);
      channel.values = std::move(values);
    }
    recording->channels.push_back(std::move(channel));
  }
}

}  // namespace sparflow
