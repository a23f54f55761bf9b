// The trajectory solver against Debian's SPTK: its recursive mlpg converges to the full solve as
// its influence range grows (models/trajectory/README.md, measured figures).
#include "tests/bench/sptk.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "models/trajectory/sliding_window.hpp"
#include "tests/support/golden_json.hpp"
#include "tests/support/temp_folder.hpp"

using namespace posed;

TEST_CASE("SPTK's mlpg with an influence range of 60 frames gives the same trajectory", "[sptk]") {
  if (!std::filesystem::exists(bench::kSptkMlpg)) {
    WARN("SKIPPED without sptk: " << Catch::getResultCapture().getCurrentTestName());
    return;
  }
  const auto golden = test::golden_json("mlpg.json");
  const int channels = golden["M"];
  constexpr int kFrames = 200;
  constexpr int kStateFrames = 8;
  trajectory::InformationForm information(channels, kFrames);
  bench::SptkInput input{channels, {}};
  std::vector<const double*> frames;
  for (int t = 0; t < kFrames; ++t) {
    const auto state = static_cast<std::size_t>(t / kStateFrames % 5);
    for (const bool variance : {false, true}) {
      for (std::size_t w = 0; w < 3; ++w) {
        for (int c = 0; c < channels; ++c) {
          const auto at = static_cast<std::size_t>(c);
          const double mean = golden["state_mean"][state][w][at];
          const double spread = golden["state_var"][state][w][at];
          input.values.push_back(static_cast<float>(variance ? spread : mean));
          information.row(t, static_cast<trajectory::Row>(2 * w))[c] = 1.0 / spread;
          information.row(t, static_cast<trajectory::Row>(2 * w + 1))[c] = mean / spread;
        }
      }
    }
    frames.push_back(information.frame(t));
  }
  trajectory::SlidingWindow window(channels, kFrames);
  window.solve(frames);
  const test::TempFolder folder;
  const auto run = bench::run_sptk(input, 60, folder.path());
  REQUIRE(run.has_value());
  REQUIRE(run->trajectory.size() == static_cast<std::size_t>(kFrames * channels));
  double squares = 0.0;
  for (int t = 0; t < kFrames; ++t) {
    for (int c = 0; c < channels; ++c) {
      squares +=
          std::pow(run->trajectory[static_cast<std::size_t>(t * channels + c)] - window.x(t)[c], 2);
    }
  }
  CHECK(std::sqrt(squares / (kFrames * channels)) < 2e-4);
}
