#include "daemon/tools/bench/bench_parts.hpp"

#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include <spdlog/fmt/fmt.h>

#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "models/gp/synthetic.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/style_type.hpp"
#include "models/style/model/style_model.hpp"

namespace posed::tools {

double cpu_pressure(const std::string& field) {
  std::ifstream file("/proc/pressure/cpu");
  std::string word;
  while (file >> word) {
    if (word.starts_with(field)) return std::atof(word.c_str() + field.size());
  }
  return -1.0;
}

CpuShare::CpuShare() : cpu_ns_(system::cpu_time_ns()), begun_ns_(system::monotonic_ns()) {}

double CpuShare::percent() const {
  return 100.0 * static_cast<double>(system::cpu_time_ns() - cpu_ns_) /
         static_cast<double>(system::monotonic_ns() - begun_ns_);
}

WorkFolder::WorkFolder() {
  std::error_code ignored;  // whoever writes into it says what is wrong
  path_ =
      std::filesystem::temp_directory_path(ignored) / ("posed_bench_" + std::to_string(getpid()));
  std::filesystem::create_directories(path_, ignored);
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Result<> write_synthetic_model(motion::Space kind, const Skeleton& skeleton, int points,
                               const std::filesystem::path& path) {
  style::StyleModel model;
  model.space = TRY(motion::describe_space(kind, skeleton));
  const auto space = TRY(motion::PoseSpace::bind(model.space, skeleton));
  const int dims = space.dims();
  model.process = gp::synthetic(points, dims).process;
  model.limit_rad = Eigen::VectorXd::Constant(dims, 0.5);
  model.gate = {.neutral = Eigen::VectorXd::Zero(dims), .swing_rad = 0.1, .fastest_stride_s = 1.0};
  model.from = "walker";
  model.to = "other";
  return style::save_model(model, path);
}

Result<config::DaemonConfig> walkers_config(const Walkers& walkers, const WorkFolder& folder) {
  const auto clip = TRY(motion::make_walker({.rate_hz = kWalkers_hz}));
  TRY(clip::write_bvh(clip, folder / "walker.bvh"));
  TRY(write_synthetic_model(motion::Space::kNative, *clip.skeleton, walkers.points,
                            folder / "model.style"));
  const StageType& type = style::style_type();
  config::DaemonConfig config;
  config.publish_endpoint = config.control_endpoint = "tcp://127.0.0.1:*";
  config.realtime = false;
  for (int i = 0; i < walkers.streams; ++i) {
    config::StreamConfig stream;
    stream.name = "walker" + std::to_string(i);
    stream.driver = "file";
    stream.options = {{"path", (folder / "walker.bvh").string()}};
    stream.stages.push_back(
        {.type = &type,
         .parameters = *complete_parameters(type.parameters, {{"gate", walkers.gate}}),
         .model = folder / "model.style"});
    config.streams.push_back(std::move(stream));
  }
  return config;
}

std::string hop_heading() {
  return fmt::format("{:<10} {:>9} {:>9} {:>9} {:>9} {:>9}", "us", "p50", "p99", "p99.9", "max",
                     "messages");
}

Findings findings_of(const HopFigures& figures, const std::string& name) {
  return Findings()
      .add("p50_us", figures.p50_us)
      .add("p99_us", figures.p99_us)
      .add("p999_us", figures.p999_us)
      .add("max_us", figures.max_us)
      .add("messages", figures.messages)
      .say(fmt::format("{:<10} {:9.1f} {:9.1f} {:9.1f} {:9.1f} {:9}", name, figures.p50_us,
                       figures.p99_us, figures.p999_us, figures.max_us, figures.messages));
}

}  // namespace posed::tools
