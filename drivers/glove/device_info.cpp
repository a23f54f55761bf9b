#include "drivers/glove/device_info.hpp"

#include <algorithm>
#include <array>
#include <sstream>

#include "proto/text/clean.hpp"
#include "proto/text/number.hpp"

namespace posed::drivers::glove {
namespace {

constexpr std::array<std::string_view, 2> kSides{"left", "right"};  // in the order of Side

}  // namespace

std::string_view side_name(Side side) noexcept { return kSides[static_cast<std::size_t>(side)]; }

Result<Side> parse_side(std::string_view name) {
  if (name == "left") return Side::kLeft;
  if (name == "right") return Side::kRight;
  return misuse("hand should be \"right\" or \"left\", not \"" + std::string(name) + "\"");
}

std::string hand_info(std::string_view driver, Side hand) {
  return std::string(driver) + " hand=" + std::string(side_name(hand));
}

DeviceInfoReader::DeviceInfoReader(const std::string& text, std::string_view driver,
                                   std::string identity)
    : driver_(driver), identity_(std::move(identity)) {
  std::istringstream words(text);
  std::string word;
  if (!(words >> word) || word != driver) add_error("does not begin with its name");
  while (words >> word) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) {
      add_error("has a word that is no key=value");
    } else if (!unread_.emplace(word.substr(0, equals), word.substr(equals + 1)).second) {
      add_error("names " + in_quotes(word.substr(0, equals)) + " twice");
    }
  }
}

void DeviceInfoReader::add_error(std::string what) {
  if (wrong_.empty()) wrong_ = std::move(what);
}

std::string DeviceInfoReader::word(std::string_view key) {
  const auto at = unread_.find(key);
  if (at == unread_.end()) {
    add_error("lacks " + in_quotes(key));
    return {};
  }
  std::string value = std::move(at->second);
  unread_.erase(at);
  if (value.empty()) add_error("has nothing for " + in_quotes(key));
  return value;
}

int DeviceInfoReader::whole(std::string_view key, int least, int most) {
  const auto value = exact_number<int>(word(key));
  if (value && *value >= least && *value <= most) return *value;
  add_error("has " + in_quotes(key) + " outside " + std::to_string(least) + " to " +
            std::to_string(most));
  return least;
}

std::size_t DeviceInfoReader::choice(std::string_view key,
                                     std::span<const std::string_view> names) {
  const std::string text = word(key);
  const auto at = std::ranges::find(names, std::string_view(text));
  if (at != names.end()) return at - names.begin();
  add_error("has an unknown " + in_quotes(key));
  return 0;
}

Side DeviceInfoReader::side() { return static_cast<Side>(choice("hand", kSides)); }

Result<> DeviceInfoReader::finish() const {
  std::string wrong = wrong_;
  // Keys from a damaged log may be garbage, so they are not shown on the terminal.
  if (wrong.empty() && !unread_.empty()) wrong = "has a key that this driver does not know";
  if (wrong.empty()) return {};
  return fail("the device info of a " + in_quotes(driver_) + " " + wrong +
                  "; the log is damaged or was made by another version",
              identity_);
}

}  // namespace posed::drivers::glove
