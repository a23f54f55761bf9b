// Addresses by the names of computers: whom a name is asked of, how often, and what is no name.
#include <catch2/catch.hpp>

#include <optional>
#include <string>
#include <vector>

#include "drivers/transport/address.hpp"

namespace posed::drivers {
namespace {

std::vector<std::string> asked_names;  // by the resolver below

std::optional<Address> motive_only(const std::string& name) {
  asked_names.push_back(name);
  if (name != "motive-pc.local") return std::nullopt;
  return ipv4_address(0xC0A80114);
}

struct WithResolver {
  WithResolver() {
    asked_names.clear();
    use_resolver(motive_only);
  }
  WithResolver(const WithResolver&) = delete;
  WithResolver& operator=(const WithResolver&) = delete;
  ~WithResolver() { use_resolver(nullptr); }
};

}  // namespace

TEST_CASE("a name is asked once, and stands wherever an address does", "[address]") {
  CHECK_FALSE(parse_endpoint("motive-pc.local:1510"));  // nobody is asked unless a program wants it
  const WithResolver resolver;
  CHECK(endpoint_text(parse_endpoint("motive-pc.local:1510").value()) == "192.168.1.20:1510");
  CHECK(endpoint_text(parse_endpoint("motive-pc.local:80").value()) == "192.168.1.20:80");
  CHECK(host_text(parse_host("motive-pc.local").value()) == "192.168.1.20");
  const Peers peers = Peers::parse({"motive-pc.local"}).value();
  CHECK(peers.allow(host_of(parse_host("192.168.1.20").value())));
  CHECK_FALSE(peers.allow(host_of(parse_host("127.0.0.1").value())));
  CHECK_FALSE(parse_host("nobody.local"));
  CHECK_FALSE(Peers::parse({"nobody.local"}));
  CHECK(asked_names == std::vector<std::string>{"motive-pc.local", "nobody.local"});
  CHECK(resolved_names() == decltype(resolved_names()){{"motive-pc.local", "192.168.1.20"}});
}

TEST_CASE("what is no name of a computer is asked of nobody", "[address]") {
  const WithResolver resolver;
  for (const char* text : {"", "*", "1.2.3.4.5", "a b", "a/b", "::g", "motive_pc", "a\n"}) {
    CHECK_FALSE(parse_host(text));
  }
  CHECK_FALSE(parse_host(std::string(300, 'a')));
  CHECK(parse_host("127.0.0.1"));
  CHECK_FALSE(parse_endpoint("motive-pc.local:65536"));
  CHECK(asked_names.empty());
  CHECK(Peers().allow(host_of(parse_host("::1").value())));  // without a list: this machine only
}

TEST_CASE("the system knows this machine by its name", "[address]") {
  use_resolver(look_up);
  const auto here = parse_endpoint("localhost:5200");
  use_resolver(nullptr);
  REQUIRE(here);
  CHECK(endpoint_text(*here) == "127.0.0.1:5200");
}

}  // namespace posed::drivers
