// TakeClips: each take of each stream of a device log as a BVH beside it. Cold.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "proto/frame/result.hpp"

namespace posed::tools {

class TakeClips {
 public:
  // A thread of nice 19 writes the clips of each take soon after it has ended, while `log` grows.
  explicit TakeClips(std::filesystem::path log);
  TakeClips(const TakeClips&) = delete;
  TakeClips& operator=(const TakeClips&) = delete;
  ~TakeClips() = default;

  // A take has begun or ended. Any thread; returns at once.
  void take_changed();
  // Ends the thread, which may be reading the log: before the log becomes a single file, because
  // that needs it alone.
  void stop();
  // After stop(), when the log is complete: writes those that are not written yet, also of a take
  // that was never ended. Call once. An end signal that comes meanwhile ends the work with an
  // error: block end_signals() before.
  Result<> finish();

 private:
  void run(const std::stop_token& stop);
  Result<> write(bool all, const std::stop_token& stop);

  std::filesystem::path log_;
  // Takes and streams; of the thread, then of finish().
  std::set<std::pair<std::int64_t, std::string>> written_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool changed_ = false;
  std::jthread thread_;  // last, because it uses all the others
};

}  // namespace posed::tools
