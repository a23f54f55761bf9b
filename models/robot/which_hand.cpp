#include "models/robot/which_hand.hpp"

#include <algorithm>
#include <cctype>
#include <string>

#include "proto/text/lower.hpp"

namespace posed::robot {
namespace {

// How many chains of joints end at or beyond each link.
std::vector<int> count_chains(const std::vector<Link>& links) {
  std::vector<int> chains(links.size());
  for (std::size_t l = links.size(); l-- > 0;) {  // children come after their parents
    if (links[l].turns && chains[l] == 0) chains[l] = 1;
    if (links[l].parent >= 0) chains[static_cast<std::size_t>(links[l].parent)] += chains[l];
  }
  return chains;
}

// What a name says by one of its words, or where `shortly` by its first one alone: "l" is also a
// link's letter.
std::optional<Side> side_of_name(const std::string& name, bool shortly) {
  const std::string text = lower(name);
  std::optional<Side> side;
  for (std::size_t at = 0; at < text.size();) {
    const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
    const auto end = std::find_if_not(text.begin() + static_cast<long>(at), text.end(), is_letter);
    const std::string word(text.begin() + static_cast<long>(at), end);
    if (shortly) {
      if (word == "l" || word == "lh") return Side::kLeft;
      if (word == "r" || word == "rh") return Side::kRight;
      return std::nullopt;
    }
    if (word.starts_with("left")) side = Side::kLeft;
    if (word.starts_with("right")) side = Side::kRight;
    at += word.size() + 1;
  }
  return side;
}

// What the names of the links below one say with one voice.
std::optional<Side> side_of_names(const std::vector<Link>& links, const std::vector<char>& below) {
  for (const bool shortly : {false, true}) {
    std::optional<Side> side;
    bool agree = true;
    for (std::size_t l = 0; l < links.size(); ++l) {
      if (below[l] == 0) continue;
      for (const std::string& name : {links[l].name, links[l].joint}) {
        const auto one = side_of_name(name, shortly);
        agree = agree && (!one || !side || *one == *side);
        if (one) side = one;
      }
    }
    if (side) return agree ? side : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::vector<HandBelow> hands_below(const std::vector<Link>& links) {
  constexpr int kMinChains = 3, kMaxChains = 5;
  const std::vector<int> chains = count_chains(links);
  std::vector<HandBelow> hands;
  for (std::size_t l = 1; l < links.size(); ++l) {
    const int above = chains[static_cast<std::size_t>(links[l].parent)];
    if (chains[l] < kMinChains || chains[l] > kMaxChains || above <= kMaxChains) continue;
    HandBelow hand{.above = static_cast<int>(l), .palm = static_cast<int>(l)};
    std::vector<char> below(links.size());
    below[l] = 1;
    for (std::size_t k = l + 1; k < links.size(); ++k) {
      const auto parent = static_cast<std::size_t>(links[k].parent);
      below[k] = below[parent];
      if (static_cast<int>(parent) == hand.palm && chains[k] == chains[l]) {
        hand.palm = static_cast<int>(k);
      }
    }
    hand.named = side_of_names(links, below);
    hands.push_back(hand);
  }
  return hands;
}

}  // namespace posed::robot
