#include "proto/zmq/keys.hpp"

#include <sys/stat.h>

#include <catch2/catch.hpp>

#include "daemon/net/security.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::net {
namespace {

TEST_CASE("keygen writes a pair that reads back, the secret half for its owner only") {
  const test::TempFolder folder;
  const auto pair = write_new_keys("stage", folder.path() / "keys");
  REQUIRE(pair);
  const auto secret = folder.path() / "keys/stage.key";
  struct stat about{};
  REQUIRE(stat(secret.c_str(), &about) == 0);
  CHECK((about.st_mode & 0777) == 0600);

  const auto read = read_secret_key(secret);
  REQUIRE(read);
  CHECK(read->secret_z85 == pair->secret_z85);
  CHECK(read->public_z85 == pair->public_z85);
  const auto pub = read_public_key(folder.path() / "keys/stage.pub");
  REQUIRE(pub);
  CHECK(*pub == pair->public_z85);
}

TEST_CASE("keygen overwrites no file and never leaves only one of the two files") {
  const test::TempFolder folder;
  REQUIRE(write_new_keys("a", folder.path()));
  const auto again = write_new_keys("a", folder.path());
  REQUIRE_FALSE(again);
  CHECK(again.error().text().find("a.key: exists already") != std::string::npos);

  folder.write("b.pub", "mine");
  const auto half = write_new_keys("b", folder.path());
  REQUIRE_FALSE(half);
  CHECK(half.error().text().find("b.pub: exists already") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder.path() / "b.key"));

  for (const auto* name : {"", "../x", "a/b", ".hidden"}) {
    const auto bad = write_new_keys(name, folder.path());
    REQUIRE_FALSE(bad);
    CHECK(bad.error().exit_code == ExitCode::kWrongUse);
  }
}

TEST_CASE("an invalid key file is refused in one sentence") {
  const test::TempFolder folder;
  REQUIRE(write_new_keys("a", folder.path()));
  const auto key = folder.path() / "a.key";
  const auto pub = folder.path() / "a.pub";
  CHECK(read_secret_key(pub).error().message.find("public half") != std::string::npos);
  CHECK(read_public_key(key).error().message.find("secret half") != std::string::npos);
  CHECK(read_secret_key(folder.path() / "none.key").error().message.find("No such file") !=
        std::string::npos);
  CHECK_FALSE(read_secret_key(folder.path()));

  REQUIRE(chmod(key.c_str(), 0640) == 0);
  CHECK(read_secret_key(key).error().message.find("others can read") != std::string::npos);

  for (const std::string& text :
       {std::string(), std::string(40, '~'), std::string(39, '0'), std::string(41, '0'),
        std::string(4000, '0'), std::string(40, '\0'), std::string(40, '\xff')}) {
    const auto bad = read_public_key(folder.write("bad.pub", text));
    REQUIRE_FALSE(bad);
    CHECK(bad.error().message.find("this is not a key") != std::string::npos);
  }
}

TEST_CASE("loopback addresses are those that only this machine can reach") {
  for (const auto* near : {"tcp://127.0.0.1:5570", "tcp://127.0.0.1:*", "tcp://127.8.1.1:1",
                           "tcp://localhost:5", "tcp://[::1]:5", "ipc:///tmp/x", "inproc://a"}) {
    CHECK(is_loopback(near));
  }
  for (const auto* far :
       {"tcp://*:5570", "tcp://0.0.0.0:5570", "tcp://192.168.1.2:1", "tcp://127.evil.example:5",
        "tcp://eth0:5", "tcp://[::]:5", "tcp://1270.0.0.1:5", "udp://127.0.0.1:5", "", "tcp://"}) {
    CHECK_FALSE(is_loopback(far));
  }
}

}  // namespace
}  // namespace posed::net
