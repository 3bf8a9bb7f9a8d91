#include "transport/net/address.h"

#include <gtest/gtest.h>
#include <net/if.h>

#include <algorithm>
#include <random>
#include <set>

namespace farfeel::transport {
namespace {

std::string round_trip(const std::string& text) {
  const auto address = parse_address(text, 7);
  return address ? to_string(*address) : address.error().message;
}

TEST(Address, ReadsWhatItWrites) {
  EXPECT_EQ(round_trip("127.0.0.1:4000"), "127.0.0.1:4000");
  EXPECT_EQ(round_trip("192.0.2.7:1"), "192.0.2.7:1");
  EXPECT_EQ(round_trip("0.0.0.0:0"), "0.0.0.0:0");
  EXPECT_EQ(round_trip("127.0.0.1"), "127.0.0.1:7");
  EXPECT_EQ(round_trip("[::1]:4000"), "[::1]:4000");
  EXPECT_EQ(round_trip("[2001:db8::1]:65535"), "[2001:db8::1]:65535");
  EXPECT_EQ(round_trip("::1"), "[::1]:7");
  EXPECT_EQ(round_trip("[::]"), "[::]:7");
}

TEST(Address, HasAScopeWhereItIsLinkLocal) {
  const unsigned index = if_nametoindex("lo");
  if (index == 0) GTEST_SKIP() << "there is no interface lo";
  const auto address = parse_address("[fe80::1%lo]:4000").value();
  EXPECT_EQ(address.scope_id, index);
  EXPECT_TRUE(address.is_link_local());
  EXPECT_EQ(to_string(address), "[fe80::1%lo]:4000");
  EXPECT_EQ(parse_address("[fe80::1%" + std::to_string(index) + "]:4000").value(), address);
  EXPECT_EQ(parse_address("fe80::1%lo", 4000).value(), address);
  Address elsewhere = address;
  elsewhere.scope_id = 4'000'000;  // no such interface: its number stands for it
  EXPECT_EQ(to_string(elsewhere), "[fe80::1%4000000]:4000");
}

struct Unreadable {
  const char* text;
  const char* why;
};

TEST(Address, SaysWhatItCannotReadAndWhatToDo) {
  for (const auto& [text, why] : {Unreadable{"", "no host"},
                                  Unreadable{":", "no host"},
                                  Unreadable{":4000", "no host"},
                                  Unreadable{"127.0.0.1", "no port"},
                                  Unreadable{"127.0.0.1:", "no port after"},
                                  Unreadable{"127.0.0.1:65536", "'65536' is not a port"},
                                  Unreadable{"127.0.0.1:-1", "'-1' is not a port"},
                                  Unreadable{"127.0.0.1:4000x", "'4000x' is not a port"},
                                  Unreadable{"127.0.0.1:4 ", "is not a port"},
                                  Unreadable{"[::1", "bracket is not closed"},
                                  Unreadable{"[::1]4000", "expected ':'"},
                                  Unreadable{"[::1]:", "no port after"},
                                  Unreadable{"[]:1", "no host"},
                                  Unreadable{"host:4000", "not a numeric"},
                                  Unreadable{"127.0.0:1", "not a whole IPv4"},
                                  Unreadable{"127.0.0.1.5:1", "not a whole IPv4"},
                                  Unreadable{"[fe80::1]:4000", "without an interface"},
                                  Unreadable{"[fe80::1%nosuch]:4000", "no interface 'nosuch'"},
                                  Unreadable{"[fe80::1%]:4000", "no interface ''"},
                                  Unreadable{"[2001:db8::1%lo]:4000", "Leave '%lo' out"},
                                  Unreadable{"[::ffff:10.0.0.1]:4000", "Write it in its own form"}}) {
    const auto address = parse_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().kind, ErrorKind::kAddress) << text;
    EXPECT_NE(address.error().message.find(why), std::string::npos) << text << ": " << address.error().message;
    EXPECT_NE(address.error().message.find("cannot read address '" + std::string(text) + "'"), std::string::npos);
    EXPECT_FALSE(resolve(text) && std::string(text) != "host:4000") << text;
  }
}

TEST(Address, KnowsWhatItStandsFor) {
  EXPECT_TRUE(loopback(false).is_loopback() && loopback(true).is_loopback());
  EXPECT_TRUE(parse_address("127.9.8.7:1")->is_loopback());
  EXPECT_FALSE(parse_address("128.0.0.1:1")->is_loopback());
  EXPECT_TRUE(any_address(false).is_any() && any_address(true).is_any());
  EXPECT_FALSE(loopback(true).is_any());
  EXPECT_FALSE(parse_address("[2001:db8::1]:1")->is_link_local());
  EXPECT_TRUE(loopback().with_port(3).has_ip_of(loopback().with_port(4)));
  EXPECT_FALSE(loopback(false).has_ip_of(loopback(true)));
}

TEST(Address, HasItsOwnBytes) {
  std::mt19937 random(1);
  std::set<AddressBytes> seen;
  std::vector<Address> addresses{any_address(false), any_address(true)};  // they differ in nothing but the family
  for (int i = 0; i < 1000; ++i) {
    Address address = addresses[random() % addresses.size()];
    switch (random() % 3) {  // one field changes
      case 0:
        address.ip[random() % (address.is_ipv6 ? 16 : 4)] ^= static_cast<std::uint8_t>(1u << random() % 8);
        break;
      case 1:
        address.port ^= static_cast<std::uint16_t>(1u << random() % 16);
        break;
      default:
        if (address.is_ipv6) address.scope_id ^= 1u << random() % 32;
    }
    if (std::find(addresses.begin(), addresses.end(), address) == addresses.end()) addresses.push_back(address);
  }
  for (const Address& address : addresses) EXPECT_TRUE(seen.insert(to_bytes(address)).second) << to_string(address);
}

TEST(Resolve, TakesNumbersAsTheyAre) {
  EXPECT_EQ(resolve("192.0.2.1:5").value(), std::vector{parse_address("192.0.2.1:5").value()});
  EXPECT_EQ(resolve("2001:db8::5", 9).value(), std::vector{parse_address("[2001:db8::5]:9").value()});
}

TEST(Resolve, LocalhostIsBothLoopbackAddresses) {
  const std::vector expected{loopback(false).with_port(4000), loopback(true).with_port(4000)};
  EXPECT_EQ(resolve("localhost:4000").value(), expected);
  EXPECT_EQ(resolve("localhost", 4000).value(), expected);
}

TEST(Resolve, FindsAnotherNameOfThisMachine) {
  // Of the resolver itself no more can be taken for granted than this: a name of /etc/hosts.
  char name[256] = "";
  ASSERT_EQ(gethostname(name, sizeof name - 1), 0);
  const auto found = resolve(std::string(name) + ":4000");
  if (!found) GTEST_SKIP() << "this machine's own name is not resolved: " << found.error().message;
  EXPECT_LE(found->size(), kMostAddresses);
  for (std::size_t i = 0; i < found->size(); ++i) {
    EXPECT_EQ((*found)[i].port, 4000);
    EXPECT_EQ(std::count(found->begin(), found->end(), (*found)[i]), 1);
  }
  const auto is_ipv6 = [](const Address& a) { return a.is_ipv6; };
  const auto ipv6 = std::count_if(found->begin(), found->end(), is_ipv6);
  if (ipv6 > 0 && ipv6 < static_cast<std::ptrdiff_t>(found->size())) {
    EXPECT_NE((*found)[0].is_ipv6, (*found)[1].is_ipv6) << "families take turns";
  }
}

TEST(Resolve, SaysThatANameIsUnknown) {
  // RFC 6761: .invalid never exists; without a network the resolver says that it could not ask.
  const auto found = resolve("nobody.invalid:4000");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::kAddress);
  EXPECT_NE(found.error().message.find("cannot find host 'nobody.invalid'"), std::string::npos);
  EXPECT_NE(found.error().message.find("numeric address"), std::string::npos) << found.error().message;
}

}  // namespace
}  // namespace farfeel::transport
