// FixedProducts: Eigen cuts large products into blocks that suit the caches of the CPU that it
// finds, and the order of a sum follows the blocks. While one of these exists the blocks are those
// of one fixed CPU, so that a training gives the same bits on any machine. Cold; a process has one
// at a time, made before the threads that compute.
#pragma once

#include <Eigen/Core>

namespace posed {

class FixedProducts {
 public:
  FixedProducts() { Eigen::setCpuCacheSizes(32 * kKiB, 512 * kKiB, 8192 * kKiB); }
  ~FixedProducts() { Eigen::setCpuCacheSizes(level_1_, level_2_, level_3_); }
  FixedProducts(const FixedProducts&) = delete;
  FixedProducts& operator=(const FixedProducts&) = delete;

 private:
  static constexpr std::ptrdiff_t kKiB = 1024;
  std::ptrdiff_t level_1_ = Eigen::l1CacheSize();
  std::ptrdiff_t level_2_ = Eigen::l2CacheSize();
  std::ptrdiff_t level_3_ = Eigen::l3CacheSize();
};

}  // namespace posed
