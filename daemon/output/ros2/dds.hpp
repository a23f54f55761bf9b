// DdsDomain, DdsWriter: a place in a DDS domain by Eclipse Cyclone DDS, and what publishes one
// topic there as nodes of ROS 2 expect it: reliable, volatile, the last sample only, and none that
// is older than kLifespan_ns.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <dds/dds.h>

#include "daemon/output/send_outcome.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::output {

// A message of ROS 2.
struct Ros2Type {
  const dds_topic_descriptor_t* descriptor;
  const char* hash;  // ROS 2's hash of the type (RIHS01), which nodes from Iron on compare
};
extern const Ros2Type kJointState, kJointTrajectory, kTfMessage;

// Who finds whom: the domain's number, the network interface, and the IPv4 addresses of other
// computers whose programs are looked for and heard. Nobody is found by multicast.
struct DdsPlace {
  int domain = 0;
  std::string interface = "lo";
  std::vector<std::string> peers{};
  [[nodiscard]] bool operator==(const DdsPlace&) const = default;
};

// The program has one of each number, which all outputs in it share. What it opens receives from
// this computer and from the peers only, whatever else the computer is connected to.
class DdsDomain {
 public:
  // Any thread. The environment (CYCLONEDDS_URI) changes nothing. Starts six threads. Cold.
  static Result<std::shared_ptr<DdsDomain>> join(const DdsPlace& place);
  ~DdsDomain();
  DdsDomain(const DdsDomain&) = delete;
  DdsDomain& operator=(const DdsDomain&) = delete;

  [[nodiscard]] dds_entity_t participant() const noexcept { return participant_; }

 private:
  DdsDomain(DdsPlace place, dds_entity_t domain) : place_(std::move(place)), domain_(domain) {}
  DdsPlace place_;
  dds_entity_t domain_, participant_ = 0;
};

// One thread.
class DdsWriter {
 public:
  static constexpr std::int64_t kLifespan_ns = kNanosPerSecond / 10;

  // `topic` as ROS names it, without a leading '/'. Cold.
  static Result<DdsWriter> open(std::shared_ptr<DdsDomain> domain, const Ros2Type& type,
                                const std::string& topic);
  DdsWriter(DdsWriter&& other) noexcept;
  DdsWriter& operator=(DdsWriter&&) = delete;
  ~DdsWriter();

  // How many read it.
  [[nodiscard]] std::size_t readers() const noexcept;
  // Takes a sample of the type. Without readers it does nothing. Never waits for one; allocates.
  SendOutcome write(const void* sample) noexcept;

 private:
  DdsWriter(std::shared_ptr<DdsDomain> domain, dds_entity_t topic, dds_entity_t writer)
      : domain_(std::move(domain)), topic_(topic), writer_(writer) {}
  std::shared_ptr<DdsDomain> domain_;
  dds_entity_t topic_, writer_;
};

}  // namespace posed::output
