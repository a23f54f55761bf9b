#include "models/style/model/style_model.hpp"

namespace posed::style {

std::vector<std::string> StyleModel::names() const {
  std::vector<std::string> names{to};
  for (const MoreStyle& style : more) names.push_back(style.name);
  return names;
}

StyleModel mixture_of(const StyleModel& model, std::span<const double> shares) {
  StyleModel mixture = model;
  mixture.more.clear();
  mixture.process.weights *= shares[0];
  mixture.process.offset *= shares[0];
  mixture.limit_rad *= shares[0];
  for (std::size_t s = 1; s < model.styles(); ++s) {
    const MoreStyle& style = model.more[s - 1];
    mixture.process.weights += shares[s] * style.function.weights;
    mixture.process.offset += shares[s] * style.function.offset;
    mixture.limit_rad += shares[s] * style.limit_rad;
  }
  return mixture;
}

}  // namespace posed::style
