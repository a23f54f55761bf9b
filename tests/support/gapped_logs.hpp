// Runs whose recorder had too little space: what their logs still contain is compared, what is
// missing is counted, and no frame is reported as different that was equal.
#pragma once

#include <cstdint>
#include <filesystem>

#include <catch2/catch.hpp>

#include "tests/support/dice.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

// `record(dice, seed, path)` makes the log of one seed; `part` as for seeds().
template <typename Record>
void check_gapped_logs(std::uint64_t part, Record&& record) {
  const TempFolder folder;
  const auto path = folder.path() / "gaps.plog";
  const auto [first, last] = seeds(part);
  replay::Expectation::Counts sum;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    Dice dice(~seed);
    record(dice, seed, path);
    const Replayed result = replayed(path);
    CHECK((result.difference ? result.difference->text() : "") == "");
    sum.compared += result.counts.compared;
    sum.lost += result.counts.lost;
    sum.after_gap += result.counts.after_gap;
    std::filesystem::remove(path);
  }
  WARN(last - first + 1 << " runs: " << sum.compared << " frames compared, " << sum.lost
                        << " not in the log, " << sum.after_gap << " after a gap");
  if (!few_seeds()) CHECK((sum.compared > 0 && sum.lost > 0 && sum.after_gap > 0));
}

}  // namespace posed::test
