#include "identification/log/recordings/mcap/cdr_message.h"

#include <algorithm>
#include <cstring>

namespace sparflow {
namespace {

using Kind = Ros2Field::Kind;
using Repeat = Ros2Field::Repeat;

// no threshold: layout of the representation
constexpr std::size_t kEncapsulation = 4, kWord = 4;
/// Most bytes that may follow a message without a word: it is filled up to a multiple of its largest number.
// no threshold: bytes of the largest number
constexpr std::size_t kMostPadding = 7;
// no threshold: a unit
constexpr std::int64_t kNanoseconds = 1'000'000'000;

double number_of(std::uint64_t bits, Kind kind) {
  switch (kind) {
    case Kind::kInt8:
      return static_cast<double>(static_cast<std::int8_t>(bits));
    case Kind::kInt16:
      return static_cast<double>(static_cast<std::int16_t>(bits));
    case Kind::kInt32:
      return static_cast<double>(static_cast<std::int32_t>(bits));
    case Kind::kInt64:
      return static_cast<double>(static_cast<std::int64_t>(bits));
    case Kind::kFloat32: {
      const auto word = static_cast<std::uint32_t>(bits);
      float value = 0.0F;
      std::memcpy(&value, &word, sizeof(value));
      return static_cast<double>(value);
    }
    case Kind::kFloat64: {
      double value = 0.0;
      std::memcpy(&value, &bits, sizeof(value));
      return value;
    }
    default:
      return static_cast<double>(bits);
  }
}

}  // namespace

CdrReader::CdrReader(std::shared_ptr<const Ros2Definition> definition, const TopicOptions& options)
    : definition_(std::move(definition)), options_(options) {}

MessageState CdrReader::read(std::string_view message, TopicSamples* samples) {
  stamp_.reset();
  header_ = false;
  if (message.size() < kEncapsulation) return MessageState::kDamaged;
  // Plain CDR of version 1: 0 is big-endian, 1 little-endian; the other two bytes are options without meaning for it.
  if (message[0] != 0 || (message[1] != 0 && message[1] != 1)) return MessageState::kOtherForm;
  big_ = message[1] == 0;
  data_ = message.substr(kEncapsulation);
  at_ = 0;
  samples_ = samples;
  if (!structure(0, TopicSamples::kMessage, 0)) return MessageState::kDamaged;
  return data_.size() - at_ > kMostPadding ? MessageState::kLonger : MessageState::kRead;
}

bool CdrReader::can_matter(const Ros2Field& field) const {
  return field.kind == Kind::kStruct ? definition_->types[field.type].has_numbers
                                     : field.kind != Kind::kString;
}

bool CdrReader::structure(std::size_t type, Place place, std::size_t depth) {
  const Ros2Type& described = definition_->types[type];
  if (described.fields.empty()) return skip(1);
  if (names_.size() <= depth) names_.resize(depth + 1);
  names_[depth] = {};
  for (std::size_t i = 0; i < described.fields.size(); ++i) {
    const Ros2Field& field = described.fields[i];
    if (depth == 0 && !stamp_ && field.repeat == Repeat::kOne && field.kind == Kind::kStruct &&
        definition_->types[field.type].name == "std_msgs/Header") {
      header_ = true;
      if (!structure(field.type, std::nullopt, depth + 1)) return false;
      header_ = false;
      continue;
    }
    Place inside;
    if (place && can_matter(field) && !samples_->crowded())
      inside = samples_->field(*place, i, field.name);
    const bool whole =
        field.repeat == Repeat::kOne ? one(field, inside, depth) : several(field, inside, depth);
    if (!whole) return false;
  }
  return true;
}

bool CdrReader::several(const Ros2Field& field, Place place, std::size_t depth) {
  std::uint32_t size = field.count;
  if (field.repeat == Repeat::kSequence && !count(&size)) return false;
  if (size > data_.size() - at_) return false;  // each element has a byte at least
  if (place && size > options_.longest_sequence) {
    too_long_.insert(field.name);
    place.reset();
  }
  // What a crowded message still holds is skipped; whether it is whole decides about its topic.
  if (place && samples_->crowded()) place.reset();
  const std::size_t bytes = ros2_bytes(field.kind);
  if (!place && bytes > 0) {
    return size == 0 || (align(bytes) && skip(std::uint64_t{bytes} * size));
  }
  if (field.names) {
    // Names are kept while the structure is read; what is left out needs none.
    ElementNames& names = names_[depth];
    names = {{}, size};
    for (std::uint32_t i = 0; i < size; ++i) {
      std::string_view name;
      if (!text(&name)) return false;
      if (i < options_.longest_sequence) names.kept.push_back(name);
    }
    return true;
  }
  const bool named = place && names_[depth].count == size;
  for (std::uint32_t i = 0; i < size; ++i) {
    Place element;
    if (place && !samples_->crowded()) {
      element =
          named ? samples_->named(*place, i, names_[depth].kept[i]) : samples_->element(*place, i);
    }
    if (!one(field, element, depth)) return false;
  }
  return true;
}

bool CdrReader::one(const Ros2Field& field, Place place, std::size_t depth) {
  if (field.kind == Kind::kStruct) return structure(field.type, place, depth + 1);
  if (field.kind == Kind::kString) {
    std::string_view ignored;
    return text(&ignored);
  }
  double value = 0.0;
  if (!number(field.kind, &value)) return false;
  if (!place) return true;
  if (field.kind == Kind::kTime) samples_->set_unit(*place, "s");
  samples_->add(*place, value);
  return true;
}

bool CdrReader::number(Kind kind, double* value) {
  if (kind == Kind::kTime) {
    if (!align(kWord) || data_.size() - at_ < 2 * kWord) return false;
    const auto seconds = static_cast<std::int32_t>(bits(kWord));
    const auto nanoseconds = static_cast<std::uint32_t>(bits(kWord));
    const std::int64_t time =
        kNanoseconds * std::int64_t{seconds} + static_cast<std::int64_t>(nanoseconds);
    if (header_) stamp_ = time;
    header_ = false;
    *value = static_cast<double>(seconds) +
             static_cast<double>(nanoseconds) / static_cast<double>(kNanoseconds);
    return true;
  }
  const std::size_t size = ros2_bytes(kind);
  if (!align(size) || data_.size() - at_ < size) return false;
  *value = number_of(bits(size), kind);
  return true;
}

bool CdrReader::text(std::string_view* text) {
  std::uint32_t size = 0;
  if (!count(&size) || size > data_.size() - at_) return false;
  *text = data_.substr(at_, size);
  at_ += size;
  if (text->ends_with('\0')) text->remove_suffix(1);  // the zero at its end is counted
  return true;
}

bool CdrReader::count(std::uint32_t* value) {
  if (!align(kWord) || data_.size() - at_ < kWord) return false;
  *value = static_cast<std::uint32_t>(bits(kWord));
  return true;
}

bool CdrReader::align(std::size_t size) {
  const std::size_t padding = (size - at_ % size) % size;
  return skip(padding);
}

bool CdrReader::skip(std::uint64_t size) {
  if (size > data_.size() - at_) return false;
  at_ += size;
  return true;
}

std::uint64_t CdrReader::bits(std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const auto byte = static_cast<unsigned char>(data_[at_ + (big_ ? i : size - 1 - i)]);
    value = value << 8U | byte;
  }
  at_ += size;
  return value;
}

}  // namespace sparflow
