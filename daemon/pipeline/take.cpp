#include "daemon/pipeline/take.hpp"

#include "proto/text/clean.hpp"

namespace posed::pipeline {

Result<> check_take_name(std::string_view name) {
  if (name.size() > kMaxTakeName) {
    return fail("the take's name has " + std::to_string(name.size()) +
                " bytes; give it one of at most " + std::to_string(kMaxTakeName));
  }
  if (clean(name) != name) {
    return fail("the take's name " + in_quotes(name) +
                " has bytes that cannot be printed; give it a name of printable UTF-8");
  }
  return {};
}

std::string words_of(const Take& take) {
  const std::string number = "take " + std::to_string(take.number);
  return take.name.empty() ? number : number + " " + in_quotes(take.name);
}

v1::TakeStats stats_of(const Take& take) {
  v1::TakeStats stats;
  stats.set_number(take.number);
  stats.set_name(take.name);
  stats.set_start_ns(take.start_ns);
  stats.set_timecode(take.timecode);
  stats.set_lost_chunks(take.lost_chunks);
  return stats;
}

}  // namespace posed::pipeline
