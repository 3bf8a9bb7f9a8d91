// Tests that run with each suite, and skip what the processor lacks.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "transport/seal/suite.h"

namespace farfeel::transport {

class EachSuite : public testing::TestWithParam<Suite> {
 protected:
  void SetUp() override {
    if (!is_available(GetParam())) GTEST_SKIP() << "this processor has no instructions for AES-GCM";
  }
};

inline std::string suite_name(const testing::TestParamInfo<Suite>& info) {
  return info.param == Suite::kAesGcm ? "AesGcm" : "ChaChaPoly";
}

#define FARFEEL_EACH_SUITE(name) \
  INSTANTIATE_TEST_SUITE_P(Suites, name, testing::Values(Suite::kAesGcm, Suite::kChaChaPoly), suite_name)

}  // namespace farfeel::transport
