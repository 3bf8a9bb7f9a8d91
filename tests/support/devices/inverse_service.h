// An imitation of the service of Haply's Inverse3: a WebSocket server on 127.0.0.1 at a port of its own, on a thread of
// its own, with an arm on springs behind it. Written from the maker's documentation, before the driver: an inventory
// after the connection, then one update for each message. What it does wrong is set while it runs.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

namespace farfeel::devices {

class InverseService {
 public:
  static constexpr double kMass_kg = 0.1, kStiffness_N_per_m = 100, kDamping_Ns_per_m = 6;

  /// What it says in place of what it ought to, from the next message on.
  enum class Fault {
    kNone,
    kSilence,        ///< answers nothing
    kTornText,       ///< the first half of the update
    kOtherText,      ///< JSON, of other types
    kHuge,           ///< 200 kB
    kNoArm,          ///< the arm is neither in the update nor in a new inventory
    kFar,            ///< a position of 1e6 m
    kNull,           ///< null for the position
    kNotCalibrated,  ///< status says so
    kNoPower,        ///< likewise
    kHangUp,         ///< closes the connection
    kOld,            ///< every second update is the one before the last
    kFragments,      ///< the update in frames of a few bytes: no fault, nothing may change
    kPings           ///< a ping before each update: likewise
  };

  InverseService();
  ~InverseService();
  InverseService(const InverseService&) = delete;
  InverseService& operator=(const InverseService&) = delete;

  [[nodiscard]] std::string uri() const;
  void set(Fault fault) { fault_ = fault; }
  void refuse_connections(bool is) { refuses_ = is; }
  void set_basis(const std::string& permutation);  ///< before the connection
  void set_grip(bool is_there) { has_grip_ = is_there; }
  void press(unsigned buttons) { buttons_ = buttons; }  ///< bits: a, b, c

  void hold_at(const std::array<double, 3>& p_m);  ///< where its springs rest; the arm's first: its base's origin

  [[nodiscard]] std::array<double, 3> force_N() const;  ///< as commanded last
  [[nodiscard]] std::array<double, 3> position_m() const;
  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  [[nodiscard]] std::uint64_t unreadable() const { return unreadable_; }  ///< messages that were no command
  /// The greatest force in any axis that was commanded since this was called last.
  [[nodiscard]] double greatest_force_N();

  struct Server;

 private:
  friend struct Server;
  std::atomic<Fault> fault_{Fault::kNone};
  std::atomic<bool> refuses_{false}, has_grip_{true};
  std::atomic<unsigned> buttons_{0};
  std::atomic<std::uint64_t> messages_{0}, unreadable_{0};
  std::unique_ptr<Server> server_;
};

}  // namespace farfeel::devices
