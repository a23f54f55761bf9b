#include "daemon/tools/devices/good_poses.hpp"

#include <unistd.h>

#include <cstdio>

#include "daemon/tools/devices/pose_screen.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/pose_check.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

bool on_terminal() { return ::isatty(STDIN_FILENO) != 0 && ::isatty(STDOUT_FILENO) != 0; }

// On a terminal a full-screen view leads the user; it is removed before anything else is printed.
// `note` says why poses are asked for again; empty at first.
Result<drivers::glove::Recorded> lead(GloveSource& source, const PosePlan& plan,
                                      const std::string& user, const std::string& note) {
  if (!on_terminal()) {
    PoseLines lines(plan);
    return record_poses(source, plan, lines);
  }
  std::string title = "posed calibrate: " + source.model().driver + ", " +
                      std::string(drivers::glove::side_name(source.hand())) + " hand of " + user;
  if (!source.identity().empty()) title += ", " + source.identity();
  PoseScreen screen(source.model(), plan, clean(title), note);
  return record_poses(source, plan, screen);
}

}  // namespace

Result<drivers::glove::Recorded> good_poses(GloveSource& source, const PosePlan& plan,
                                            const std::string& user, bool force) {
  auto recorded = lead(source, plan, user, {});
  while (recorded) {
    const auto check = drivers::glove::check_poses(source.model(), *recorded);
    if (!check) return std::unexpected(check.error());
    if (check->sensors == 0) return recorded;  // nothing was measured; the fit reports it
    if (check->usable() || force) {
      std::fprintf(stderr, "posed: %s%s\n",
                   check->usable() ? "" : "warning: ", check->verdict().c_str());
      return recorded;
    }
    if (!on_terminal()) {
      return fail(check->verdict() +
                  "; no calibration was written (--force writes it all the same)");
    }
    PosePlan again = plan;
    again.seconds.fill(0.0);
    for (const auto pose : check->failed()) {
      again.seconds[static_cast<std::size_t>(pose)] = plan.seconds[static_cast<std::size_t>(pose)];
    }
    const auto more = lead(source, again, user, check->verdict());
    if (!more) return more;
    for (const auto pose : again.poses()) {
      (*recorded)[static_cast<std::size_t>(pose)] = (*more)[static_cast<std::size_t>(pose)];
    }
  }
  return recorded;
}

}  // namespace posed::tools
