#include "master_station/devices/link/link_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>

namespace farfeel::devices {
namespace {

tl::unexpected<std::string> failure(std::string_view what) {
  return tl::unexpected(fmt::format("{}: {}", what, std::strerror(errno)));
}

void* map(int fd) {
  return mmap(nullptr, sizeof(LinkMemory), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
}

}  // namespace

void MappedLink::Unmap::operator()(LinkMemory* memory) const noexcept {
  munmap(memory, sizeof(LinkMemory));
}

void MappedLink::Close::operator()(int* fd) const noexcept {
  ::close(*fd);
  delete fd;
}

tl::expected<MappedLink, std::string> MappedLink::create() {
  const int fd = memfd_create("farfeel-device", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (fd < 0) return failure("could not make the memory to share with farfeel-device");
  // Neither end may cut it short under the other: a read of what is not there any more would end the haptic loop.
  if (ftruncate(fd, sizeof(LinkMemory)) != 0 ||
      fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    auto failed = failure("could not size the memory to share with farfeel-device");
    ::close(fd);
    return failed;
  }
  void* const at = map(fd);
  if (at == MAP_FAILED) {
    auto failed = failure("could not map the memory to share with farfeel-device");
    ::close(fd);
    return failed;
  }
  return MappedLink(new (at) LinkMemory(), fd);
}

tl::expected<MappedLink, std::string> MappedLink::open(int fd) {
  struct stat about {};
  if (fstat(fd, &about) != 0) return failure(fmt::format("descriptor {} is not open", fd));
  constexpr const char* kOther = "the station that started this program was built with another version of it";
  if (about.st_size != static_cast<off_t>(sizeof(LinkMemory)))
    return tl::unexpected(fmt::format("{} ({} bytes shared, {} expected)", kOther, about.st_size, sizeof(LinkMemory)));
  void* const at = map(fd);
  if (at == MAP_FAILED) return failure("could not map the memory shared with the station");
  MappedLink link(static_cast<LinkMemory*>(at), fd);
  if (link.memory().magic != LinkMemory::kMagic || link.memory().size != sizeof(LinkMemory)) {
    return tl::unexpected(std::string(kOther));
  }
  return link;
}

}  // namespace farfeel::devices
