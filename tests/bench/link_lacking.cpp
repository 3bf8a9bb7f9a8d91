// What stands for the libraries that this build lacks.
#include "tests/bench/link_method.h"

namespace farfeel::bench {

#ifndef FARFEEL_BENCH_ENET
MadeMethod make_enet(const TwoEnds&) {
  return tl::unexpected(std::string("built without libenet-dev"));
}
#endif

#ifndef FARFEEL_BENCH_NGTCP2
MadeMethod make_ngtcp2(const TwoEnds&, transport::Suite) {
  return tl::unexpected(std::string("built without libngtcp2-dev and libngtcp2-crypto-gnutls-dev"));
}
#endif

}  // namespace farfeel::bench
