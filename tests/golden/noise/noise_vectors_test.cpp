// Our Noise against the public vectors of other implementations, byte for byte. The file says where it is from.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "transport/seal/noise.h"

namespace farfeel::transport {
namespace {

using Bytes = std::vector<std::byte>;

Bytes from_hex(const std::string& hex) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

Key32 key_from_hex(const std::string& hex) {
  const Bytes bytes = from_hex(hex);
  Key32 key{};
  EXPECT_EQ(bytes.size(), key.size());
  std::copy_n(bytes.begin(), key.size(), key.begin());
  return key;
}

void play(const nlohmann::json& v, Suite suite) {
  if (!is_available(suite)) GTEST_SKIP() << "this processor has no instructions for AES-GCM";
  const KeyPair initiator_keys = key_pair_of(key_from_hex(v.at("init_static")));
  const KeyPair responder_keys = key_pair_of(key_from_hex(v.at("resp_static")));
  EXPECT_EQ(responder_keys.public_key, key_from_hex(v.at("init_remote_static")));
  const Key32 psk = key_from_hex(v.at("init_psks").at(0));
  NoiseInitiator initiator(suite, from_hex(v.at("init_prologue")), initiator_keys, responder_keys.public_key, psk,
                           key_pair_of(key_from_hex(v.at("init_ephemeral"))));
  NoiseResponder responder(suite, from_hex(v.at("resp_prologue")), responder_keys,
                           key_pair_of(key_from_hex(v.at("resp_ephemeral"))));

  const auto& messages = v.at("messages");
  ASSERT_EQ(messages.size(), 6u);
  const auto payload = [&](std::size_t i) { return from_hex(messages[i].at("payload")); };
  const auto ciphertext = [&](std::size_t i) { return from_hex(messages[i].at("ciphertext")); };

  Bytes first(ciphertext(0).size()), read_payload(payload(0).size());
  ASSERT_EQ(initiator.write_first(payload(0), first), first.size());
  EXPECT_EQ(first, ciphertext(0));
  const auto who = responder.read_first(ciphertext(0), read_payload);
  ASSERT_TRUE(who);
  EXPECT_EQ(*who, initiator_keys.public_key);
  EXPECT_EQ(read_payload, payload(0));

  Bytes second(ciphertext(1).size());
  read_payload.resize(payload(1).size());
  const SplitKeys theirs = responder.write_second(psk, payload(1), second);
  EXPECT_EQ(second, ciphertext(1));
  const auto ours = initiator.read_second(ciphertext(1), read_payload);
  ASSERT_TRUE(ours);
  EXPECT_EQ(read_payload, payload(1));

  const Bytes hash = from_hex(v.at("handshake_hash"));
  for (const SplitKeys& keys : {*ours, theirs}) {
    EXPECT_TRUE(std::equal(hash.begin(), hash.end(), keys.handshake_hash.begin(), keys.handshake_hash.end()));
    // Messages from the third on alternate: the initiator's, the responder's.
    const SealKey up(suite, keys.initiator_to_responder), down(suite, keys.responder_to_initiator);
    for (std::size_t i = 2; i < messages.size(); ++i) {
      const SealKey& key = i % 2 == 0 ? up : down;
      const std::uint64_t counter = (i - 2) / 2;
      const Bytes plain = payload(i);
      Bytes sealed(plain.size() + kTagBytes), opened(plain.size());
      key.seal(counter, {}, plain, sealed);
      EXPECT_EQ(sealed, ciphertext(i)) << "message " << i;
      EXPECT_TRUE(key.open(counter, {}, ciphertext(i), opened));
      EXPECT_EQ(opened, plain);
    }
  }
}

nlohmann::json vector_named(const std::string& name) {
  std::ifstream file(NOISE_VECTORS);
  const auto all = nlohmann::json::parse(file);
  for (const auto& v : all.at("vectors"))
    if (v.at("protocol_name") == name) return v;
  ADD_FAILURE() << "no vector " << name;
  return {};
}

TEST(NoiseVectors, AesGcm) {
  play(vector_named("Noise_IKpsk2_25519_AESGCM_BLAKE2b"), Suite::kAesGcm);
}
TEST(NoiseVectors, ChaChaPoly) {
  play(vector_named("Noise_IKpsk2_25519_ChaChaPoly_BLAKE2b"), Suite::kChaChaPoly);
}

}  // namespace
}  // namespace farfeel::transport
