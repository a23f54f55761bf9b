#include "daemon/tools/run/take_clips.hpp"

#include <chrono>
#include <csignal>
#include <string>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/system/realtime.hpp"
#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/run/serve.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::tools {
namespace {

// The log has what came before the end of a take after its next commit.
constexpr std::chrono::milliseconds kCommitted{1000};

Result<> write_clip(Result<clip::Clip> clip, const std::filesystem::path& path) {
  if (!clip) return std::unexpected(clip.error());
  std::error_code error;
  if (std::filesystem::exists(path, error)) return fail("exists already", path.string());
  never_replace(path);
  clip::hold_missing(*clip);
  for (const std::string& warning : clip->warnings) {
    spdlog::warn("{}: {}", path.string(), warning);
  }
  TRY(clip::write_bvh(*clip, path));
  spdlog::info("wrote {}: {} frames", path.string(), clip->frames());
  return {};
}

bool end_signal_came() {
  const sigset_t signals = end_signals();
  constexpr timespec kAtOnce{};
  return sigtimedwait(&signals, nullptr, &kAtOnce) > 0;
}

}  // namespace

TakeClips::TakeClips(std::filesystem::path log)
    : log_(std::move(log)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

void TakeClips::take_changed() {
  {
    const std::scoped_lock lock(mutex_);
    changed_ = true;
  }
  wake_.notify_all();
}

void TakeClips::run(const std::stop_token& stop) {
  system::name_thread("posed-clips");
  system::give_way();
  while (!stop.stop_requested()) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, stop, [this] { return changed_; });
    changed_ = false;
    wake_.wait_for(lock, stop, kCommitted, [] { return false; });
    lock.unlock();
    if (stop.stop_requested()) return;
    if (auto done = write(false, stop); !done && !stop.stop_requested()) {
      spdlog::warn("clips of takes are written when posed ends: {}", done.error().text());
    }
  }
}

void TakeClips::stop() {
  thread_.request_stop();
  thread_.join();
}

Result<> TakeClips::finish() { return write(true, {}); }

// A clip that cannot be written is a warning; the log is not changed.
Result<> TakeClips::write(bool all, const std::stop_token& stop) {
  const std::string stem = (log_.parent_path() / log_.stem()).string();
  const auto each = [&](const log::TakeRow& take, const std::string& stream,
                        Result<clip::Clip> clip) {
    if (!all && take.last_item == log::kToTheEnd) return;
    if (!written_.emplace(take.id, stream).second) return;
    const std::string path = stem + "-" + std::to_string(take.id) + "-" + stream + ".bvh";
    if (auto written = write_clip(std::move(clip), path); !written) {
      spdlog::warn("take {} of stream {} is no clip: {}", take.id, stream, written.error().text());
    }
  };
  // During the run the signals are for who serves.
  const auto goes_on = [&] { return all ? !end_signal_came() : !stop.stop_requested(); };
  return each_take_clip(log_, each, goes_on);
}

}  // namespace posed::tools
