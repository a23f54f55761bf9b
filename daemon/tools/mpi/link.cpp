#include "daemon/tools/mpi/link.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include <mpi.h>

#include "proto/frame/whole_file.hpp"

namespace posed::mpi {
namespace {

constexpr std::chrono::milliseconds kLook{1};  // MPI's own waiting keeps a core busy

}  // namespace

// MPI's errors end the process (its default), so no call's return value is looked at.
Link::Link() {
  const HeldSignals held;  // MPI's threads begin here and leave signals to those that can hold them
  int threads = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &threads);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  int size = 0;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  std::string own(MPI_MAX_PROCESSOR_NAME, '\0');
  int length = 0;
  MPI_Get_processor_name(own.data(), &length);
  std::string all(own.size() * static_cast<std::size_t>(size), '\0');
  MPI_Allgather(own.data(), MPI_MAX_PROCESSOR_NAME, MPI_CHAR, all.data(), MPI_MAX_PROCESSOR_NAME,
                MPI_CHAR, MPI_COMM_WORLD);
  for (std::size_t at = 0; at < all.size(); at += own.size()) hosts_.emplace_back(&all[at]);
}

Link::~Link() { MPI_Finalize(); }

std::string Link::name(int rank) const {
  return "rank " + std::to_string(rank) + " on " + hosts_[static_cast<std::size_t>(rank)];
}

int Link::ranks_here() const {
  return static_cast<int>(std::ranges::count(hosts_, hosts_[static_cast<std::size_t>(rank_)]));
}

void Link::send(int to, Kind kind, std::span<const std::byte> bytes) {
  MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, to, static_cast<int>(kind),
           MPI_COMM_WORLD);
}

std::optional<Message> Link::poll() {
  int there = 0;
  MPI_Status status{};
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return std::nullopt;
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  Message message{status.MPI_SOURCE, static_cast<Kind>(status.MPI_TAG),
                  std::vector<std::byte>(static_cast<std::size_t>(size))};
  MPI_Recv(message.bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
           MPI_STATUS_IGNORE);
  return message;
}

Message Link::next() {
  while (true) {
    if (auto message = poll()) return std::move(*message);
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace posed::mpi
