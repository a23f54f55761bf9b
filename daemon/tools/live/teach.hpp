// The steps of `posed ctl teach`: walks, or shows of signs, with a
// countdown, and the training. Cold.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct TeachOptions {
  std::string stream, name;                 // of the style
  double neutral_s = 20.0, style_s = 20.0;  // of the walks; 0: those that were marked before
  bool more = false;                        // the walks are learnt beside those before
  bool anew = false;                        // a lesson that is not finished is forgotten
  std::vector<std::string> signs{};         // to show one after the other; none: walks
  int shows = 3;                            // good ones of each
  double show_s = 5.0;
  bool quiet = false;  // prints nothing
};

// Sends a request and returns the daemon's answer; a refusal is an error.
using Ask = std::function<Result<v1::ControlReply>(const v1::ControlRequest& request)>;

// Returns the last answer, which tells the model and its first frame. Errors: a walk is refused,
// the training fails, or Ctrl-C, which also ends what the daemon is doing.
Result<v1::ControlReply> teach(const TeachOptions& options, const Ask& ask);

}  // namespace posed::tools
