#include "daemon/tools/run/take_clips.hpp"

#include <csignal>
#include <ctime>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/run/serve.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/frames_clip.hpp"

namespace posed::tools {
namespace {

Result<> write_clip(Result<clip::Clip> clip, const std::filesystem::path& path) {
  if (!clip) return std::unexpected(clip.error());
  std::error_code error;
  if (std::filesystem::exists(path, error)) return fail("exists already", path.string());
  clip::hold_missing(*clip);
  for (const std::string& warning : clip->warnings) {
    spdlog::warn("{}: {}", path.string(), warning);
  }
  if (auto written = clip::write_bvh(*clip, path); !written) return written;
  spdlog::info("wrote {}: {} frames", path.string(), clip->frames());
  return {};
}

}  // namespace

Result<> write_take_clips(const std::filesystem::path& log) {
  const std::string stem = (log.parent_path() / log.stem()).string();
  const auto write = [&](const log::TakeRow& take, const std::string& stream,
                         Result<clip::Clip> clip) {
    const std::string path = stem + "-" + std::to_string(take.id) + "-" + stream + ".bvh";
    if (auto written = write_clip(std::move(clip), path); !written) {
      spdlog::warn("take {} of stream {} is no clip: {}", take.id, stream, written.error().text());
    }
  };
  const sigset_t signals = end_signals();
  constexpr timespec kAtOnce{};
  return replay::each_take_clip(log, write,
                                [&] { return sigtimedwait(&signals, nullptr, &kAtOnce) <= 0; });
}

}  // namespace posed::tools
