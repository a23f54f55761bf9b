// JsonReader: reads JSON (RFC 8259) from untrusted text, value by value, where it lies. Allocates
// nothing and remembers nothing but its place, so it runs in hot code.
//
//   JsonReader json(text);
//   if (json.enter_object()) {
//     for (std::string_view key; json.next(key);) {
//       if (key == "fps") { ... json.number(fps) ... } else { json.skip(); }
//     }
//   }
//   if (!json.ok()) ...
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers {

// All calls are RT-safe. After `next` exactly one value must be read: each of the calls below it
// reads one, whatever it is. After a fault all of them return false.
class JsonReader {
 public:
  enum class Fault : std::uint8_t {
    kNone,
    kCut,    // the text ends inside a value
    kWrong,  // this is not JSON
    kDeep    // more than kMaxDepth objects and lists inside each other
  };
  static constexpr int kMaxDepth = 32;

  explicit JsonReader(std::string_view text) noexcept
      : at_(text.data()), end_(text.data() + text.size()) {}

  [[nodiscard]] bool ok() const noexcept { return fault_ == Fault::kNone; }
  [[nodiscard]] Fault fault() const noexcept { return fault_; }

  // Goes to the next member of the object, or element of the list, that was entered last. False
  // at its end, which leaves it.
  [[nodiscard]] bool next(std::string_view& key) noexcept;
  [[nodiscard]] bool next() noexcept;

  // True if the value is an object (a list); it is entered.
  [[nodiscard]] bool enter_object() noexcept { return enter('{', true); }
  [[nodiscard]] bool enter_array() noexcept { return enter('[', false); }
  // True if the value is a number. NaN for what programs write instead of a number that is not
  // finite: NaN, Infinity, -Infinity, bare or in quotes; and for a number beyond a double.
  [[nodiscard]] bool number(double& value) noexcept;
  [[nodiscard]] bool boolean(bool& value) noexcept;
  // The text between the quotes, escapes as they are written (unescape_json).
  [[nodiscard]] bool text(std::string_view& value) noexcept;
  void skip() noexcept;

  // Nothing but white space is left.
  [[nodiscard]] bool at_end() noexcept;

 private:
  bool fail(Fault fault) noexcept;
  [[nodiscard]] bool peek(char& first) noexcept;
  [[nodiscard]] bool separate(char close) noexcept;
  [[nodiscard]] bool enter(char open, bool object) noexcept;
  [[nodiscard]] bool quoted(std::string_view& value) noexcept;
  [[nodiscard]] bool word(std::string_view expected) noexcept;
  // Takes a value that is no object or list, or enters it.
  void skip_any() noexcept;

  const char* at_;
  const char* end_;
  int depth_ = 0;
  std::uint64_t objects_ = 0;  // bit: depth at which an object was entered, not a list
  bool first_ = false;         // nothing was read from the one entered last
  Fault fault_ = Fault::kNone;
};

// Writes the text that a JSON string stands for, as UTF-8, and returns its length: at most `room`,
// cut between two characters. Escapes that are wrong are left as they are.
RT_SAFE [[nodiscard]] std::size_t unescape_json(std::string_view raw,
                                                std::span<char> room) noexcept;

}  // namespace posed::drivers
