// A window that slides with its past carried on gives what a solve of all frames so far would.
#include "models/trajectory/carried_past.hpp"

#include <random>

#include <catch2/catch.hpp>

#include "tests/support/allocations.hpp"
#include "tests/unit/models/trajectory/golden_mlpg.hpp"

using namespace posed;
using trajectory::Boundary;
using trajectory::SlidingWindow;

namespace {

constexpr int kCarriedChannels = 3;
constexpr int kAllFrames = 60;
constexpr std::size_t kWide = 9;

trajectory::InformationForm random_information() {
  trajectory::InformationForm information(kCarriedChannels, kAllFrames);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> uniform(0.1, 2.0);
  for (int t = 0; t < kAllFrames; ++t) {
    for (int r = 0; r < trajectory::kRows; ++r) {
      for (int c = 0; c < kCarriedChannels; ++c) {
        information.row(t, static_cast<trajectory::Row>(r))[c] = uniform(random);
      }
    }
  }
  return information;
}

// The largest difference between the first window, of frames `from` to `to` - 1, and the second.
double worst(const SlidingWindow& window, int from, int to, const SlidingWindow& all,
             int all_from) {
  double most = 0.0;
  for (int t = from; t < to; ++t) {
    for (int c = 0; c < kCarriedChannels; ++c) {
      most = std::max(most, std::abs(window.x(t - from)[c] - all.x(t - all_from)[c]));
    }
  }
  return most;
}

}  // namespace

TEST_CASE("a window that carries its past forgets nothing", "[generate]") {
  const auto information = random_information();
  const auto frames = test::frames_of(information);
  SlidingWindow window(kCarriedChannels, kAllFrames);
  SlidingWindow all(kCarriedChannels, kAllFrames);
  trajectory::CarriedPast past(window.stride());
  const auto before = test::allocations();
  for (std::size_t end = 1; end <= frames.size(); ++end) {
    const std::size_t first = end > kWide ? end - kWide : 0;
    const auto recent = std::span(frames).subspan(first, end - first);
    past.begin(static_cast<long>(first));
    window.solve(recent, Boundary::kDrop, nullptr, past.incoming());  // leaves nothing
    past.begin(static_cast<long>(first));
    window.solve(recent, Boundary::kDrop, nullptr,
                 end < 3 ? past.incoming() : past.incoming_and_outgoing());
    all.solve(std::span(frames).first(end));
    CHECK(worst(window, static_cast<int>(first), static_cast<int>(end), all, 0) < 1e-9);
  }
  CHECK(test::allocations() == before);
}

TEST_CASE("a window that begins elsewhere carries nothing", "[generate]") {
  const auto information = random_information();
  const auto frames = test::frames_of(information);
  SlidingWindow window(kCarriedChannels, kAllFrames);
  SlidingWindow alone(kCarriedChannels, kAllFrames);
  trajectory::CarriedPast past(window.stride());
  past.begin(0);
  window.solve(std::span(frames).first(kWide), Boundary::kDrop, nullptr,
               past.incoming_and_outgoing());
  const std::size_t first = GENERATE(0, 1, 2);
  const bool forgotten = GENERATE(false, true);
  if (forgotten) past.forget();
  const auto later = std::span(frames).subspan(first, kWide);
  past.begin(static_cast<long>(first));
  window.solve(later, Boundary::kDrop, nullptr, past.incoming());
  alone.solve(later);
  const auto from = static_cast<int>(first);
  const double off = worst(window, from, from + static_cast<int>(kWide), alone, from);
  if (first == 1 && !forgotten) {
    CHECK(off > 1e-3);
  } else {
    CHECK(off == 0.0);
  }
}
