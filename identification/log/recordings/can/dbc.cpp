#include "identification/log/recordings/can/dbc.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <set>

#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: bits of an identifier and of the longest frame (CAN FD); the message that collects signals without one
constexpr std::uint32_t kExtended = 0x80000000U, kIdBits = 0x1FFFFFFFU, kNoMessage = 0xC0000000U;
constexpr std::uint32_t kFrameBits = 512, kStandardIds = 0x7FFU;

struct Token {
  enum class Kind { kEnd, kWord, kText, kMark };
  Kind kind = Kind::kEnd;
  std::string_view text;
  int line = 0;
  bool is(std::string_view word) const { return kind != Kind::kText && text == word; }
};

/// Words, texts in quotes and single marks.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : text_(text) {}

  Token next() {
    Token token = ahead_ ? *ahead_ : read();
    ahead_.reset();
    return token;
  }
  const Token& peek() {
    if (!ahead_) ahead_ = read();
    return *ahead_;
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  static bool is_mark(char c) { return std::strchr(":|@()[],;", c) != nullptr && c != '\0'; }

  Token read() {
    while (at_ < text_.size() && is_blank(text_[at_])) {
      if (text_[at_] == '\n') ++line_;
      ++at_;
    }
    Token token;
    token.line = line_;
    if (at_ == text_.size()) return token;
    const std::size_t begin = at_;
    if (text_[at_] == '"') {
      for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
        if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
        if (text_[at_] == '\n') ++line_;
      }
      token.kind = Token::Kind::kText;
      token.text = text_.substr(begin + 1, at_ - begin - 1);
      at_ = std::min(at_ + 1, text_.size());
      return token;
    }
    token.kind = is_mark(text_[at_]) ? Token::Kind::kMark : Token::Kind::kWord;
    ++at_;
    while (token.kind == Token::Kind::kWord && at_ < text_.size() && !is_blank(text_[at_]) &&
           !is_mark(text_[at_]) && text_[at_] != '"') {
      ++at_;
    }
    token.text = text_.substr(begin, at_ - begin);
    return token;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::optional<Token> ahead_;
};

/// What SG_ says of multiplexing before SG_MUL_VAL_ is known.
struct Switched {
  bool switched = false;  ///< m<number>
  std::uint64_t by = 0;
};

class DbcReader {
 public:
  DbcReader(const std::string& file, std::string_view text, const DbcOptions& options)
      : file_(file), tokens_(text), options_(options) {
    dbc_.file = file;
  }

  Dbc read() {
    for (;;) {
      const Token token = tokens_.next();
      if (token.kind == Token::Kind::kEnd) break;
      statement(token);
    }
    for (std::size_t i = 0; i < dbc_.messages.size(); ++i) settle_switches(i);
    if (dbc_.messages.empty()) {
      throw InputError({file_, 0, 0}, "",
                       "no message (BO_) in it; expected a CAN database in the DBC format");
    }
    return std::move(dbc_);
  }

 private:
  [[noreturn]] void fail(const Token& token, const std::string& expected) const {
    throw InputError(
        {file_, token.line, 0}, "",
        fmt::format("found {}, expected {}",
                    token.kind == Token::Kind::kEnd ? std::string("the end of the file")
                                                    : "\"" + printable(token.text) + "\"",
                    expected));
  }
  Token word(const char* expected) {
    const Token token = tokens_.next();
    if (token.kind != Token::Kind::kWord) fail(token, expected);
    return token;
  }
  void mark(const char* wanted, const char* where) {
    const Token token = tokens_.next();
    if (!token.is(wanted)) fail(token, fmt::format("\"{}\" {}", wanted, where));
  }
  template <class T>
  T number(const Token& token, std::string_view text, const char* expected) const {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) fail(token, expected);
    if constexpr (std::is_same_v<T, double>) {
      if (!std::isfinite(value)) fail(token, expected);
    }
    return value;
  }
  double real(const char* expected) {
    const Token token = word(expected);
    return number<double>(token, token.text, expected);
  }

  void statement(const Token& token) {
    if (token.is("BO_")) {
      read_message();
    } else if (token.is("SG_")) {
      if (current_ == nullptr) fail(token, "a message (BO_) before its signals");
      read_signal();
    } else if (token.is("SIG_VALTYPE_")) {
      read_value_type();
    } else if (token.is("SG_MUL_VAL_")) {
      read_switch();
    } else if (token.is("CM_")) {
      read_comment();
    } else if (token.is("NS_")) {
      // The names of statements, which are none here.
      while (tokens_.peek().kind != Token::Kind::kEnd && !tokens_.peek().is("BS_") &&
             !tokens_.peek().is("BU_") && !tokens_.peek().is("BO_")) {
        tokens_.next();
      }
    } else if (token.kind == Token::Kind::kWord && token.text.ends_with('_') && !token.is("BS_") &&
               !token.is("BU_")) {
      skip();
    }
  }

  void skip() {
    while (tokens_.peek().kind != Token::Kind::kEnd && !tokens_.next().is(";")) {
    }
  }

  void read_message() {
    const Token id = word("the identifier of a message");
    const auto bits = number<std::uint32_t>(id, id.text, "the identifier of a message, 0 or more");
    const Token name = word("the name of a message");
    mark(":", "behind the name of a message");
    const Token size = word("the length of a message [bytes]");
    number<std::uint32_t>(size, size.text, "the length of a message [bytes]");
    word("the sender of a message");
    current_ = nullptr;
    DbcMessage message;
    message.extended = (bits & kExtended) != 0;
    message.id = bits & kIdBits;
    message.name = printable(name.text);
    message.line = id.line;
    if (bits != kNoMessage && ((bits & ~(kExtended | kIdBits)) != 0 ||
                               (!message.extended && message.id > kStandardIds))) {
      fail(id, "an identifier of 11 bits, or of 29 with bit 31 set");
    }
    const bool unused = bits == kNoMessage;
    const bool again = !unused && !by_id_.try_emplace(bits, dbc_.messages.size()).second;
    if (again) {
      dbc_.warnings.push_back(
          fmt::format("{}:{}: message {} has the identifier of another; the first is taken", file_,
                      message.line, message.name));
    }
    if (unused || again) {
      ignored_ = std::move(message);
      current_ = &ignored_;
      return;
    }
    dbc_.messages.push_back(std::move(message));
    switched_.emplace_back();
    current_ = &dbc_.messages.back();
  }

  void read_signal() {
    DbcSignal signal;
    Switched by;
    const Token name = word("the name of a signal");
    signal.name = printable(name.text);
    signal.line = name.line;
    if (!tokens_.peek().is(":")) {
      const Token multiplex = word("\":\" or a mark of multiplexing (M, m0, m0M)");
      std::string_view text = multiplex.text;
      if (text.ends_with('M')) {
        signal.multiplexor = true;
        text.remove_suffix(1);
      }
      if (text.starts_with('m')) {
        by = {true,
              number<std::uint64_t>(multiplex, text.substr(1), "a multiplexor's value, as m0")};
      } else if (!text.empty()) {
        fail(multiplex, "\":\" or a mark of multiplexing (M, m0, m0M)");
      }
    }
    mark(":", "behind the name of a signal");
    const Token start = word("the start bit of a signal");
    signal.start = number<std::uint32_t>(start, start.text, "a start bit from 0 to 511");
    mark("|", "behind a start bit");
    const Token length = word("the length of a signal [bits]");
    signal.length = number<std::uint32_t>(length, length.text, "a length of 1 bit or more");
    mark("@", "behind the length of a signal");
    const Token order = word("byte order and sign (1+, 1-, 0+, 0-)");
    if (order.text != "1+" && order.text != "1-" && order.text != "0+" && order.text != "0-") {
      fail(order, "byte order and sign: 1 (Intel) or 0 (Motorola), + (unsigned) or - (signed)");
    }
    signal.big_endian = order.text.front() == '0';
    if (order.text.back() == '-') signal.kind = DbcSignal::Kind::kSigned;
    mark("(", "before factor and offset");
    signal.factor = real("a factor");
    mark(",", "between factor and offset");
    signal.offset = real("an offset");
    mark(")", "behind factor and offset");
    mark("[", "before the range");
    while (!tokens_.peek().is("]") && tokens_.peek().kind != Token::Kind::kEnd &&
           tokens_.peek().line == order.line) {
      tokens_.next();
    }
    mark("]", "behind the range");
    const Token unit = tokens_.next();
    if (unit.kind != Token::Kind::kText) fail(unit, "the unit of a signal in quotes");
    signal.unit = printable(unit.text);
    // Receivers follow to the end of the line; the words of the next statement end them.
    while (tokens_.peek().line == unit.line && tokens_.peek().kind != Token::Kind::kEnd) {
      tokens_.next();
    }
    add_signal(std::move(signal), by, length);
  }

  void add_signal(DbcSignal signal, const Switched& by, const Token& length) {
    if (signal.length > 64) {
      dbc_.warnings.push_back(fmt::format("{}:{}: signal {} left out: {} bits are no number", file_,
                                          signal.line, signal.name, signal.length));
      return;
    }
    if (signal.length == 0 || signal.start >= kFrameBits || 8 * signal.bytes() > kFrameBits) {
      fail(length, "a signal within the 64 bytes of the longest frame");
    }
    if (current_ == &ignored_) return;
    if (by_name_.try_emplace({dbc_.messages.size() - 1, signal.name}, current_->signals.size())
            .second) {
      current_->signals.push_back(std::move(signal));
      switched_.back().push_back(by);
    } else {
      fail(length, fmt::format("another name than {}, which the message has already", signal.name));
    }
  }

  /// The signal that a statement names, or null for one that is unknown or left out.
  DbcSignal* named(const Token& id, const Token& name) {
    const auto message =
        by_id_.find(number<std::uint32_t>(id, id.text, "the identifier of a message"));
    if (message == by_id_.end()) return nullptr;
    const auto signal = by_name_.find({message->second, std::string(name.text)});
    if (signal == by_name_.end()) return nullptr;
    return &dbc_.messages[message->second].signals[signal->second];
  }

  void read_value_type() {
    const Token id = word("the identifier of a message"), name = word("the name of a signal");
    if (tokens_.peek().is(":")) tokens_.next();
    const Token type = word("0 (integer), 1 (float) or 2 (double)");
    skip();
    DbcSignal* signal = named(id, name);
    if (signal == nullptr || type.is("0")) return;
    const bool single = type.is("1");
    if (!single && !type.is("2")) fail(type, "0 (integer), 1 (float) or 2 (double)");
    if (signal->length != (single ? 32U : 64U)) {
      fail(type, fmt::format("{} bits for signal {}, which has {}", single ? 32 : 64, signal->name,
                             signal->length));
    }
    signal->kind = single ? DbcSignal::Kind::kFloat : DbcSignal::Kind::kDouble;
  }

  void read_switch() {
    const Token id = word("the identifier of a message"), name = word("the name of a signal");
    const Token parent = word("the name of a multiplexor");
    std::string ranges;
    for (;;) {
      const Token token = tokens_.next();
      if (token.kind == Token::Kind::kEnd || token.is(";")) break;
      ranges += token.text;
    }
    DbcSignal* signal = named(id, name);
    const DbcSignal* above = named(id, parent);
    if (signal == nullptr) return;
    if (above == nullptr) fail(parent, "the name of a multiplexor of the same message");
    auto& message = dbc_.messages[by_id_.at(number<std::uint32_t>(id, id.text, ""))];
    signal->parent = static_cast<int>(above - message.signals.data());
    signal->switches.clear();
    for (std::string_view rest = ranges; !rest.empty();) {
      const std::string_view part = rest.substr(0, rest.find(','));
      rest.remove_prefix(std::min(part.size() + 1, rest.size()));
      const std::size_t dash = part.find('-');
      const char* expected = "ranges of a multiplexor's values, as 0-3, 7-7";
      const auto from = number<std::uint64_t>(parent, part.substr(0, dash), expected);
      const auto to =
          dash == part.npos ? from : number<std::uint64_t>(parent, part.substr(dash + 1), expected);
      signal->switches.emplace_back(from, to);
    }
  }

  void read_comment() {
    if (!tokens_.peek().is("SG_")) return skip();
    tokens_.next();
    const Token id = word("the identifier of a message"), name = word("the name of a signal");
    const Token text = tokens_.next();
    if (text.kind != Token::Kind::kText) fail(text, "a comment in quotes");
    if (DbcSignal* signal = named(id, name)) signal->comment = printable(text.text);
    skip();
  }

  /// Gives the signals m<number> without SG_MUL_VAL_ their multiplexor: the only one that nothing switches.
  void settle_switches(std::size_t index) {
    DbcMessage& message = dbc_.messages[index];
    const std::vector<Switched>& by = switched_[index];
    int root = -1, roots = 0;
    for (std::size_t i = 0; i < message.signals.size(); ++i) {
      if (!message.signals[i].multiplexor || by[i].switched) continue;
      root = static_cast<int>(i);
      ++roots;
    }
    std::set<std::string> lost;
    for (std::size_t i = 0; i < message.signals.size(); ++i) {
      DbcSignal& signal = message.signals[i];
      if (!by[i].switched || signal.parent >= 0) continue;
      if (roots != 1) {
        throw InputError({file_, signal.line, 0}, "",
                         fmt::format("signal {} is multiplexed and message {} has {} multiplexors "
                                     "(M), expected one, or a line SG_MUL_VAL_ for the signal",
                                     signal.name, message.name, roots));
      }
      signal.parent = root;
      signal.switches = {{by[i].by, by[i].by}};
    }
    for (const DbcSignal& signal : message.signals) {
      int depth = 0;
      for (int parent = signal.parent; parent >= 0; ++depth) {
        if (depth >= options_.deepest) {
          throw InputError({file_, signal.line, 0}, "",
                           fmt::format("more than {} multiplexors above signal {}, or a circle of "
                                       "them",
                                       options_.deepest, signal.name));
        }
        parent = message.signals[static_cast<std::size_t>(parent)].parent;
      }
    }
  }

  const std::string& file_;
  Tokens tokens_;
  const DbcOptions& options_;
  Dbc dbc_;
  DbcMessage* current_ = nullptr;
  DbcMessage ignored_;
  std::vector<std::vector<Switched>> switched_;  ///< of each message's signals
  std::map<std::uint32_t, std::size_t> by_id_;
  std::map<std::pair<std::size_t, std::string>, std::size_t> by_name_;
};

}  // namespace

std::uint32_t DbcSignal::bytes() const {
  if (!big_endian) return (start + length + 7) / 8;
  // From the highest bit down to bit 0 of its byte, then whole bytes.
  const std::uint32_t first = start % 8 + 1;
  return start / 8 + 1 + (length > first ? (length - first + 7) / 8 : 0);
}

std::uint64_t dbc_bits(const DbcSignal& signal, std::span<const std::uint8_t> data) {
  std::uint64_t bits = 0;
  std::uint32_t left = signal.length;
  if (signal.big_endian) {
    std::uint32_t byte = signal.start / 8, room = signal.start % 8 + 1;  // bits of the byte in use
    while (left > 0) {
      const std::uint32_t take = std::min(left, room);
      const std::uint32_t part = (data[byte] >> (room - take)) & ((1U << take) - 1);
      bits = bits << take | part;
      left -= take;
      ++byte;
      room = 8;
    }
  } else {
    std::uint32_t byte = signal.start / 8, below = signal.start % 8, done = 0;
    while (left > 0) {
      const std::uint32_t take = std::min(left, 8 - below);
      const std::uint64_t part = (data[byte] >> below) & ((1U << take) - 1);
      bits |= part << done;
      done += take;
      left -= take;
      ++byte;
      below = 0;
    }
  }
  return bits;
}

double dbc_value(const DbcSignal& signal, std::uint64_t bits) {
  double number = 0.0;
  switch (signal.kind) {
    case DbcSignal::Kind::kUnsigned:
      number = static_cast<double>(bits);
      break;
    case DbcSignal::Kind::kSigned: {
      const std::uint64_t sign = std::uint64_t{1} << (signal.length - 1);
      number = static_cast<double>(static_cast<std::int64_t>((bits ^ sign) - sign));
      break;
    }
    case DbcSignal::Kind::kFloat: {
      const auto word = static_cast<std::uint32_t>(bits);
      float value = 0.0F;
      std::memcpy(&value, &word, 4);
      number = static_cast<double>(value);
      break;
    }
    case DbcSignal::Kind::kDouble:
      std::memcpy(&number, &bits, 8);
      break;
  }
  return signal.factor * number + signal.offset;
}

Dbc parse_dbc(const std::string& file, std::string_view text, const DbcOptions& options) {
  return DbcReader(file, text, options).read();
}

}  // namespace sparflow
