#include "deploy/front/key.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <ctime>
#include <iostream>
#include <string>
#include <string_view>

#include "codecs/settings/command_line.h"
#include "codecs/text/nearest_word.h"
#include "transport/keys/key_folder.h"
#include "transport/keys/key_text.h"

namespace farfeel::front {
namespace {

using namespace transport;

constexpr std::array<std::string_view, 6> kVerbs = {"new", "show", "trust", "revoke", "list", "psk"};
constexpr std::array kRoles = {Role::kOperator, Role::kSlave};

constexpr const char* kExamples = R"(Two machines get to know each other in four commands:

  farfeel key new                              on each machine; prints a line to paste at the other end
  farfeel key trust operator anna pub_...      on the slave's machine: anna may operate it
  farfeel key trust slave lab pub_...          on the operator's machine: she may connect to lab

Then compare the fingerprints over a telephone: what one end trusts is what the other end's `farfeel key show` says.
docs/keys.md tells more.)";

constexpr const char* kPskWords =
    R"(A pre-shared key is a second secret that both ends know. Without one a session is sealed with X25519 alone: nobody
can read or change it today. But somebody who records it now, and keeps the recording until there are quantum computers
that break X25519, can read it then: poses, forces and the scene. With a pre-shared key the recording stays shut even
then, as long as that key stays secret.

Make one, carry it to the other end by a way that you trust (not through a network that may be recorded), and give it
to both ends:

  farfeel key psk > psk.txt
  farfeel key trust operator anna pub_... --psk - < psk.txt      on the slave's machine
  farfeel key trust slave lab pub_... --psk - < psk.txt          on the operator's machine)";

struct Wishes {
  std::string folder, role, name, key, expires, psk, roles;
  bool is_key_only = false;
};

int failed(const std::string& message) {
  fmt::print(stderr, "farfeel key: {}\n", message);
  return 1;
}

std::int64_t wall_clock_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + static_cast<std::int64_t>(now.tv_nsec);
}

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return as_name("");
  return as_name(std::string_view(name.data()).substr(0, std::string_view(name.data()).find('.')));
}

void show_key(const Wishes& wishes, const Key32& key) {
  const std::string word = key_to_text(KeyKind::kPublic, key);
  if (wishes.is_key_only) {
    fmt::print("{}\n", word);
    return;
  }
  const std::string name = wishes.name.empty() ? host_name() : wishes.name;
  fmt::print(
      "fingerprint   {}\n"
      "public key    {}\n\n"
      "For operating a slave from this machine, paste on the slave's machine:\n"
      "  farfeel key trust operator {} {}\n\n"
      "For serving as a slave, paste on the operator's machine:\n"
      "  farfeel key trust slave {} {}\n\n"
      "The name is for people: choose another one at will. The fingerprint is what to compare over a telephone.\n",
      fingerprint(key), word, name, word, name, word);
}

int make_new(const Wishes& wishes) {
  const auto folder = KeyFolder::make(wishes.folder);
  if (!folder) return failed(folder.error().message);
  const auto pair = folder->make_identity();
  if (!pair) return failed(pair.error().message);
  if (!wishes.is_key_only) fmt::print("This machine has a new key, in {}\n\n", folder->path());
  show_key(wishes, pair->public_key);
  return 0;
}

KeysResult<KeyFolder> folder_that_is_there(const Wishes& wishes) {
  auto folder = KeyFolder::open(wishes.folder);
  if (!folder && folder.error().kind == KeysErrorKind::kMissing)
    return tl::unexpected(KeysError{
        KeysErrorKind::kMissing, fmt::format("there are no keys in {}: begin with  farfeel key new", wishes.folder)});
  return folder;
}

int show(const Wishes& wishes) {
  const auto folder = folder_that_is_there(wishes);
  if (!folder) return failed(folder.error().message);
  const auto pair = folder->identity();
  if (!pair) return failed(pair.error().message);
  show_key(wishes, pair->public_key);
  return 0;
}

KeysResult<Key32> psk_of(const Wishes& wishes) {
  std::string word = wishes.psk;
  if (word == "-") {
    std::getline(std::cin, word);
    while (!word.empty() && (word.back() == '\r' || word.back() == ' ')) word.pop_back();
  }
  return key_from_text(KeyKind::kPsk, word);
}

void say(const TrustEntry& entry, std::int64_t now_ns) {
  fmt::print("  {:<16}  {}  {:<19}  {}{}\n", entry.name, fingerprint(entry.public_key),
             !entry.expires_ns ? "never expires"
                               : fmt::format("{} {}", entry.is_expired(now_ns) ? "EXPIRED" : "until",
                                             date_ending_at(*entry.expires_ns)),
             entry.psk ? "psk" : "no psk", entry.roles == Roles{} ? "" : "  may " + roles_to_text(entry.roles));
}

std::string_view words_for(Role role) {
  return role == Role::kOperator ? "operators, who may operate this machine" : "slaves, whom this machine may operate";
}

int trust(const Wishes& wishes) {
  const Role role = wishes.role == name_of(Role::kOperator) ? Role::kOperator : Role::kSlave;
  if (!is_name(wishes.name))
    return failed(fmt::format("\"{}\" is no name: take 1 to 32 letters, digits and . - _", wishes.name));
  const auto key = key_from_text(KeyKind::kPublic, wishes.key);
  if (!key) return failed(key.error().message);
  const auto folder = KeyFolder::make(wishes.folder);
  if (!folder) return failed(folder.error().message);
  const auto list = folder->trusted(role);
  if (!list) return failed(list.error().message);

  // What is not said anew stays as it was.
  TrustEntry entry;
  if (const TrustEntry* old = list->find_name(wishes.name)) entry = *old;
  entry.name = wishes.name;
  entry.public_key = *key;
  if (wishes.expires == "never") {
    entry.expires_ns.reset();
  } else if (!wishes.expires.empty()) {
    const auto end_ns = end_of_day_ns(wishes.expires);
    if (!end_ns) return failed(end_ns.error().message);
    if (wall_clock_ns() >= *end_ns)
      return failed(
          fmt::format("{} is over already: name a later day, or  farfeel key revoke {}", wishes.expires, wishes.name));
    entry.expires_ns = *end_ns;
  }
  if (wishes.psk == "none") {
    entry.psk.reset();
  } else if (!wishes.psk.empty()) {
    const auto psk = psk_of(wishes);
    if (!psk) return failed(psk.error().message);
    entry.psk = *psk;
  }
  if (!wishes.roles.empty()) {
    if (role == Role::kSlave)
      return failed("--role is of operators: what a slave lets this machine do, the slave says");
    const auto roles = roles_from_text(wishes.roles);
    if (!roles)
      return failed(fmt::format("--role takes a list of operate, watch and edit, as in operate,edit, and not \"{}\"",
                                wishes.roles));
    entry.roles = *roles;
  }
  if (const auto done = folder->trust(role, entry); !done) return failed(done.error().message);

  fmt::print("{} is now among the {}:\n", entry.name, words_for(role));
  say(entry, wall_clock_ns());
  fmt::print("Compare the fingerprint with what  farfeel key show  says at the other end.\n");
  if (!entry.psk) fmt::print("There is no pre-shared key:  farfeel key psk --help  says what that means.\n");
  return 0;
}

int revoke(const Wishes& wishes) {
  const auto folder = folder_that_is_there(wishes);
  if (!folder) return failed(folder.error().message);
  bool is_done = false;
  for (const Role role : kRoles) {
    if (!wishes.role.empty() && wishes.role != name_of(role)) continue;
    const auto done = folder->revoke(role, wishes.name);
    if (!done) return failed(done.error().message);
    if (!*done) continue;
    is_done = true;
    fmt::print("{} is no longer among the {}.{}\n", wishes.name, words_for(role),
               role == Role::kOperator ? " A slave that runs notices within a second." : "");
  }
  if (!is_done) return failed(fmt::format("nobody named \"{}\" is trusted here: see  farfeel key list", wishes.name));
  return 0;
}

int list(const Wishes& wishes) {
  const auto folder = folder_that_is_there(wishes);
  if (!folder) return failed(folder.error().message);
  int status = 0;
  for (const Role role : kRoles) {
    fmt::print("{}:\n", words_for(role));
    const auto trusted = folder->trusted(role);
    if (!trusted) {
      status = failed(trusted.error().message);
      continue;
    }
    if (trusted->entries().empty()) fmt::print("  nobody\n");
    for (const TrustEntry& entry : trusted->entries()) say(entry, wall_clock_ns());
  }
  return status;
}

int make_psk() {
  KeyPair fresh;
  fill_randomly(fresh.secret);
  fmt::print("{}\n", key_to_text(KeyKind::kPsk, fresh.secret));
  return 0;
}

}  // namespace

int key_command(int argc, char** argv) {
  Wishes wishes;
  CLI::App app("This machine's key, and whom it trusts.", "farfeel key");
  app.footer(kExamples);
  app.require_subcommand(1);
  const auto verb = [&](const char* name, const char* words) {
    CLI::App* command = app.add_subcommand(name, words);
    if (std::string_view(name) != "psk")
      command->add_option("--folder", wishes.folder, "the folder of the keys; ~/.config/farfeel/keys unless told");
    return command;
  };
  CLI::App* new_command = verb("new", "make this machine's key, once, and print what show prints");
  CLI::App* show_command = verb("show", "the fingerprint, the public key, and the lines to paste at the other end");
  for (CLI::App* command : {new_command, show_command}) {
    command->add_option("--name", wishes.name, "what the other end shall call this machine; its host name unless told");
    command->add_flag("--key-only", wishes.is_key_only, "print the public key alone, for scripts");
  }
  CLI::App* trust_command = verb("trust", "trust a key under a name, or renew what is trusted under it");
  trust_command
      ->add_option("role", wishes.role, "operator: may operate this machine; slave: this machine may operate it")
      ->required()
      ->check(CLI::IsMember({"operator", "slave"}));
  trust_command->add_option("name", wishes.name, "what to call it: letters, digits and . - _")->required();
  trust_command->add_option("key", wishes.key, "its public key, pub_...")->required();
  trust_command->add_option("--expires", wishes.expires,
                            "the last day, as 2027-01-31, to its end in UTC by this machine's clock; or never");
  trust_command->add_option("--psk", wishes.psk,
                            "a pre-shared key, psk_...; - reads it from the input, which keeps it out of the shell's "
                            "history; or none");
  trust_command->add_option("--role", wishes.roles,
                            "what an operator may do, a list of operate (feel with a hand), watch (the scene) and edit "
                            "(it; who may edit may watch); operate alone unless told");
  trust_command->footer(
      "  farfeel key trust operator anna pub_... --expires 2027-01-31\n"
      "  farfeel key trust slave lab pub_... --psk - < psk.txt\n"
      "  farfeel key trust operator bert pub_... --role operate,edit\n\n"
      "What is not said anew of a name that is trusted stays as it was.");
  CLI::App* revoke_command = verb("revoke", "trust a name no more");
  revoke_command->add_option("name", wishes.name, "as farfeel key list tells")->required();
  revoke_command->add_option("--role", wishes.role, "as operator or slave alone; both unless told")
      ->check(CLI::IsMember({"operator", "slave"}));
  CLI::App* list_command = verb("list", "whom this machine trusts: names, fingerprints, last days");
  CLI::App* psk_command = verb("psk", "make a pre-shared key, and print it");
  psk_command->footer(kPskWords);

  if (argc < 2) {
    fmt::print("{}", app.help());
    return 2;
  }
  const std::string_view word = argv[1];
  if (!word.starts_with('-') && std::find(kVerbs.begin(), kVerbs.end(), word) == kVerbs.end()) {
    fmt::print(stderr, "farfeel key: there is no command \"{}\"", word);
    if (const auto near = codecs::nearest_word(word, kVerbs); !near.empty())
      fmt::print(stderr, "; did you mean \"farfeel key {}\"?", near);
    fmt::print(stderr, "\nfarfeel key --help lists them all.\n");
    return 2;
  }
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  if (psk_command->parsed()) return make_psk();
  if (wishes.folder.empty()) {
    const auto folder = default_key_folder();
    if (!folder) return failed(folder.error().message + " with --folder");
    wishes.folder = *folder;
  }
  if (!wishes.name.empty() && (new_command->parsed() || show_command->parsed()) && !is_name(wishes.name))
    return failed(fmt::format("\"{}\" is no name: take 1 to 32 letters, digits and . - _", wishes.name));
  if (new_command->parsed()) return make_new(wishes);
  if (show_command->parsed()) return show(wishes);
  if (trust_command->parsed()) return trust(wishes);
  if (revoke_command->parsed()) return revoke(wishes);
  if (list_command->parsed()) return list(wishes);
  return 2;
}

}  // namespace farfeel::front
