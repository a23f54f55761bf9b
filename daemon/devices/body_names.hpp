// The names under which the bodies of sources are streamed. Cold.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

namespace posed::devices {

// "<source>-<body>" in lower case; every other character than a-z, 0-9, '-' and '_' becomes '-';
// cut so that the suffix of raw input fits behind it.
[[nodiscard]] std::string plain_stream_name(const std::string& source, const std::string& body);

// Gives each body a name of its own, which it keeps when it leaves and returns.
class BodyNames {
 public:
  // `reserved` are the names of all other streams, those of their raw input included.
  explicit BodyNames(std::set<std::string> reserved) : taken_(std::move(reserved)) {}

  // `number` counts the bodies that the source calls the same, from 1. If the plain name is taken
  // the body gets "-2", "-3" and so on, in the order in which bodies appear.
  // Null once a source has named thousands of bodies, because devices can invent names without end.
  [[nodiscard]] const std::string* name_of(const std::string& source, const std::string& body,
                                           int number);

 private:
  static constexpr std::size_t kMaxKept = 4096;  // of a source
  struct Body {
    std::string source, body;
    int number;
    auto operator<=>(const Body&) const = default;
  };
  std::set<std::string> taken_;  // also the raw_name() of each
  std::map<Body, std::string> names_;
  std::map<std::string, std::size_t> kept_;  // by source
};

}  // namespace posed::devices
