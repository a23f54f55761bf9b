// The gesture model's parse_model on any bytes, as a file and as the payload of a right header.
// Every tree of an accepted model is searched, and no lookup may leave its tree.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>

#include "models/gesture/model_file.hpp"
#include "models/gesture/tree_drawing.hpp"
#include "tests/fuzz/model_envelope.hpp"

namespace {

using namespace posed::gesture;

constexpr int kWalkedLabels = 4;  // of each position; more would cost time and find nothing new

void walk_all(const GestureModel& model) {
  const int labels = std::min(kWalkedLabels, static_cast<int>(model.labels.size()));
  for (int number = 0; number < labels * labels * labels; ++number) {
    const Context context{number % labels, number / labels % labels, number / labels / labels};
    double sum = duration(model, context).mean[0];
    for (int state = 0; state < kStates; ++state) {
      for (int group = 0; group < std::ssize(model.groups); ++group) {
        sum += leaf(model, state, group, context).mean[0][0];
      }
    }
    if (!(sum < 1e300)) std::abort();
  }
}

void try_bytes(const std::string& bytes) {
  const auto model = parse_model(std::as_bytes(std::span(bytes)), "fuzz");
  if (!model) return;
  walk_all(*model);
  static_cast<void>(trees_dot(*model, {}));
  // An accepted model can be written and read back with the same bytes.
  const std::string written = serialize_model(*model);
  const auto again = parse_model(std::as_bytes(std::span(written)), "fuzz");
  if (!again || serialize_model(*again) != written) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  try_bytes(input);
  try_bytes(posed::fuzz::as_model_file(input));
  return 0;
}
