#include "models/gesture/play_order.hpp"

#include <sstream>

#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::gesture {
namespace {

std::string known_labels(const GestureModel& model) {
  return joined(model.labels, " ", &Label::name);
}

}  // namespace

Result<PlayOrder> make_play_order(const GestureModel& model, std::span<const std::string> names,
                                  double tempo, bool loop) {
  if (names.empty()) return misuse("there is no label to perform; give some, as in \"g 1 c\"");
  if (names.size() > kMaxLabels) {
    return misuse(std::to_string(names.size()) + " labels are too many at once; give at most " +
                  std::to_string(kMaxLabels));
  }
  if (!(tempo >= kMinTempo && tempo <= kMaxTempo)) {
    return misuse("the tempo is out of range; it goes from 0.5 to 2");
  }
  PlayOrder order{.tempo = static_cast<float>(tempo),
                  .loop = loop,
                  .size = static_cast<std::uint16_t>(names.size()),
                  .label = {}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const int index = model.label_index(names[i]);
    if (index < 0) {
      return misuse("the model does not know the label " + in_quotes(names[i]) +
                    "; it knows: " + known_labels(model));
    }
    order.label[i] = static_cast<std::uint16_t>(index);
  }
  return order;
}

std::vector<std::string> split_labels(const std::string& text) {
  std::istringstream words(text);
  std::vector<std::string> labels;
  for (std::string word; words >> word;) labels.push_back(std::move(word));
  return labels;
}

}  // namespace posed::gesture
