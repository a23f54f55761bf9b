// SignLesson: the signs of a hand that are shown on the stage, each several times, and the gesture
// model that is learnt from the shows. A show is a take of one movement: rest, the sign, held, and
// the way back to rest, so that rest is learnt from every show. Cold; no thread of its own. Copies
// share nothing.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "models/gesture/recording.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

inline constexpr std::size_t kMinShows = 3;   // of each sign, before it is learnt
inline constexpr std::size_t kMaxShows = 10;  // of each sign
inline constexpr std::size_t kMaxSigns = 16;
inline constexpr std::string_view kRest = "rest";  // the label of what is between signs

class SignLesson {
 public:
  struct Learnt {
    std::string bytes;    // of the model's file
    std::string verdict;  // a sentence
  };

  // Whether a sign of this name may be shown now; the error is a sentence for the client.
  Result<> check_label(const std::string& label) const;
  // Keeps the show if it can be learnt from. Returns how it went, or as an error why it is refused:
  // values are missing, the hand did not hold still, or the sign is like another one. The clip has
  // a hand's angles [rad], NaN where nothing was measured.
  Result<std::string> add(const std::string& label, clip::HandClip show);
  void forget(const std::string& label) { shows_.erase(label); }

  // Whether there are signs, each shown often enough; the error says what is missing.
  Result<> check_ready() const;
  // Learns all signs, so that a hand that makes one is told from the others and from none of them,
  // and each is performed as it was shown. Errors: it is not ready; `go_on` said no.
  Result<Learnt> train(const std::function<bool()>& go_on) const;

  // By label: the good shows.
  [[nodiscard]] const std::map<std::string, std::vector<Recording>>& signs() const {
    return shows_;
  }

 private:
  std::map<std::string, std::vector<Recording>> shows_;
};

}  // namespace posed::gesture
