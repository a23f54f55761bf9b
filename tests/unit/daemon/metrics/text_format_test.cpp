// The text format of Prometheus, as https://prometheus.io/docs/instrumenting/exposition_formats
// describes it.
#include "daemon/metrics/text_format.hpp"

#include <limits>
#include <string>

#include <catch2/catch.hpp>

namespace posed::metrics {
namespace {

TEST_CASE("a family has its help, its type and its samples, with any text as a label") {
  TextFormat text;
  text.counter("posed_frames_total", "Frames published.");
  text.sample({{"stream", "walker"}, {"quality", "held"}}, std::uint64_t{12});
  text.sample({{"stream", "a\"b\\c\nd"}}, std::uint64_t{18'000'000'000'000'000'000U});
  text.gauge("posed_lag_seconds", "Lag.");
  text.sample({}, 0.01);
  text.sample({{"stream", ""}}, std::numeric_limits<double>::quiet_NaN());
  text.sample({}, std::numeric_limits<double>::infinity());
  CHECK(text.finish() ==
        "# HELP posed_frames_total Frames published.\n"
        "# TYPE posed_frames_total counter\n"
        "posed_frames_total{stream=\"walker\",quality=\"held\"} 12\n"
        "posed_frames_total{stream=\"a\\\"b\\\\c\\nd\"} 18000000000000000000\n"
        "# HELP posed_lag_seconds Lag.\n"
        "# TYPE posed_lag_seconds gauge\n"
        "posed_lag_seconds 0.01\n"
        "posed_lag_seconds{stream=\"\"} NaN\n"
        "posed_lag_seconds +Inf\n");
}

TEST_CASE("a duration counts in every bucket that is at least as long, and in the sum") {
  publish::DurationBuckets times;
  const auto& bounds = publish::DurationBuckets::kBounds_ns;
  times.add(-3);         // a clock that was set: as if it took no time
  times.add(bounds[0]);  // exactly a bound belongs to it
  times.add(bounds[0] + 1);
  times.add(bounds.back() + 1);
  const auto counts = times.counts();
  CHECK(counts.count[0] == 2);
  CHECK(counts.count[1] == 1);
  CHECK(counts.count.back() == 1);
  CHECK(counts.sum_ns == static_cast<std::uint64_t>(2 * bounds[0] + bounds.back() + 2));

  TextFormat text;
  text.histogram("posed_stage_seconds", "Time.");
  text.sample({{"stage", "style"}}, counts);
  const std::string made = text.finish();
  INFO(made);
  for (const char* line : {"# TYPE posed_stage_seconds histogram\n",
                           "\nposed_stage_seconds_bucket{stage=\"style\",le=\"5e-06\"} 2\n",
                           "\nposed_stage_seconds_bucket{stage=\"style\",le=\"1e-05\"} 3\n",
                           "\nposed_stage_seconds_bucket{stage=\"style\",le=\"0.017\"} 3\n",
                           "\nposed_stage_seconds_bucket{stage=\"style\",le=\"1\"} 3\n",
                           "\nposed_stage_seconds_bucket{stage=\"style\",le=\"+Inf\"} 4\n",
                           "\nposed_stage_seconds_sum{stage=\"style\"} 1.000010002\n",
                           "\nposed_stage_seconds_count{stage=\"style\"} 4\n"}) {
    INFO(line);
    CHECK(made.find(line) != std::string::npos);
  }
}

}  // namespace
}  // namespace posed::metrics
