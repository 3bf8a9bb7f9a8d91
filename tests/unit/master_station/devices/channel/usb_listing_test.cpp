#include "master_station/devices/channel/usb_listing.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <string>

#include "tests/support/private_folder.h"

namespace farfeel::devices {
namespace {

TEST(UsbListing, names_another_process_that_has_the_file_open) {
  const test_support::PrivateFolder folder;
  const std::string path = folder / "node";
  const int own = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_GE(own, 0);
  EXPECT_EQ(other_user_of(path), "") << "this process is not another";
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const int file = ::open(path.c_str(), O_RDONLY);
    if (file < 0 || ::write(ready[1], "", 1) != 1) ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  char token = 0;
  ASSERT_EQ(::read(ready[0], &token, 1), 1);
  const std::string user = other_user_of(path);
  EXPECT_NE(user.find("(" + std::to_string(child) + ")"), std::string::npos) << user;
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(other_user_of(path), "");
  for (const int fd : {own, ready[0], ready[1]}) ::close(fd);
  ::unlink(path.c_str());
}

TEST(UsbListing, of_the_real_machine_has_no_device_with_an_id_that_nobody_has) {
  EXPECT_TRUE(find_usb_devices(std::array{UsbId{0x0000, 0x0000}}, {}).empty());
}

}  // namespace
}  // namespace farfeel::devices
