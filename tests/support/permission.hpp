// For tests of files without permission: runs as a user without it, and checks the error message.
#pragma once

#include <grp.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

namespace posed::test {

inline constexpr uid_t kNobody = 65534;

// root may open everything, so a process of root acts as another user while this object lives.
class AsNobody {
 public:
  AsNobody() {
    if (::getuid() != 0) return;
    groups_.resize(static_cast<std::size_t>(::getgroups(0, nullptr)));
    groups_.resize(
        static_cast<std::size_t>(::getgroups(static_cast<int>(groups_.size()), groups_.data())));
    REQUIRE(::setgroups(0, nullptr) == 0);
    REQUIRE(::setresgid(kNobody, kNobody, 0) == 0);
    REQUIRE(::setresuid(kNobody, kNobody, 0) == 0);
    changed_ = true;
  }
  ~AsNobody() {
    if (!changed_) return;
    const bool back = ::setresuid(0, 0, 0) == 0 && ::setresgid(0, 0, 0) == 0 &&
                      ::setgroups(groups_.size(), groups_.data()) == 0;
    if (!back) std::abort();
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  std::vector<gid_t> groups_;
  bool changed_ = false;
};

// Checks that the message names the node, the udev rule and what to do with it.
inline void check_sentence(const std::string& sentence, const std::string& node) {
  INFO(sentence);
  CHECK(sentence.find("no permission for " + node) != std::string::npos);
  CHECK(sentence.find("config/udev/70-posed.rules") != std::string::npos);
  CHECK(sentence.find("install") != std::string::npos);
  CHECK(sentence.find("plug the glove in again") != std::string::npos);
}

}  // namespace posed::test
