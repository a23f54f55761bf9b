// What the benchmarks of a whole daemon share.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/tools/bench/hop_subscriber.hpp"
#include "daemon/tools/command/findings.hpp"
#include "models/motion/pose_space.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::tools {

// A field of the line `some` of the CPU's pressure: "avg10=" [percent] or "total=" [us since boot];
// negative if the kernel does not report it.
[[nodiscard]] double cpu_pressure(const std::string& field);

// The CPU time of this process since the construction, in percent of one core.
class CpuShare {
 public:
  CpuShare();
  [[nodiscard]] double percent() const;

 private:
  std::int64_t cpu_ns_, begun_ns_;
};

// A folder that is deleted with this object.
class WorkFolder {
 public:
  WorkFolder();
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// Writes a style model of so many synthetic poses, in a pose space of the skeleton.
Result<> write_synthetic_model(motion::Space space, const Skeleton& skeleton, int points,
                               const std::filesystem::path& path);

inline constexpr double kWalkers_hz = 120.0;
struct Walkers {
  int streams = 1;
  int points = 200;  // poses in their style model
  bool gate = false;
};
// A daemon on free ports, without real-time rights, that styles synthetic walkers from files.
Result<config::DaemonConfig> walkers_config(const Walkers& walkers, const WorkFolder& folder);

// The heading of a table whose rows are findings_of().
[[nodiscard]] std::string hop_heading();
// The figures, with the row `name` of that table as their line.
[[nodiscard]] Findings findings_of(const HopFigures& figures, const std::string& name);

}  // namespace posed::tools
