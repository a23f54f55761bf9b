// The sequence numbers of a VirtualDaemon's streams: they never go back, and none is missing
// without a word.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "tests/support/virtual_daemon.hpp"

namespace posed::test {

// All streams of one name, whichever slots and generations they had.
struct NumbersOfName {
  std::set<std::uint64_t> published;
  std::uint64_t missed = 0, decoded = 0, unpublished = 0;
  bool left = false;
  bool last_decoded = false;  // the last of the streams had frames
};

// The numbers of a name never go back, and those that were not published were reported as missing.
// Within a stream a pose may be repeated under its number. After a kill frames were under way. The
// stages of `adding` make frames while none comes, which have numbers beyond those decoded.
inline std::map<std::string, NumbersOfName> check_numbers(
    const std::vector<VirtualBody>& bodies, bool killed = false,
    const std::set<std::string>& adding = {}) {
  std::map<std::string, NumbersOfName> names;
  for (const VirtualBody& body : bodies) {
    if (!body.refusal.empty()) continue;
    INFO(body.name << ", stream " << body.stream);
    NumbersOfName& name = names[body.name];
    const auto& sequences = body.published.sequences;
    CHECK(std::ranges::is_sorted(sequences));
    if (!sequences.empty() && !name.published.empty()) {
      CHECK(sequences.front() > *name.published.rbegin());
    }
    name.published.insert(sequences.begin(), sequences.end());
    name.missed += body.published.missed;
    name.last_decoded = body.decoded > name.decoded;
    name.decoded = body.decoded;
    name.unpublished += body.unpublished;
    name.left = body.left;
  }
  for (const auto& [text, name] : names) {
    INFO(text);
    const std::uint64_t known = name.published.size() + name.missed;
    const std::uint64_t newest = name.published.empty() ? 0 : *name.published.rbegin();
    if (!adding.contains(text)) CHECK(known <= name.decoded);
    if (name.unpublished == 0 && !killed) CHECK(known >= std::max(newest, name.decoded));
  }
  return names;
}

}  // namespace posed::test
