// PriorityMutex: a mutex between a real-time thread and an ordinary one. While the real-time thread
// waits for it, the holder runs at that thread's priority (PTHREAD_PRIO_INHERIT), so that no third
// thread can keep it from letting go. std::mutex does not do that.
#pragma once

#include <pthread.h>

namespace posed::system {

// For std::scoped_lock. Not recursive. Any thread.
class PriorityMutex {
 public:
  PriorityMutex() noexcept {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityMutex() { pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  void lock() noexcept { pthread_mutex_lock(&mutex_); }
  void unlock() noexcept { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_{};
};

}  // namespace posed::system
