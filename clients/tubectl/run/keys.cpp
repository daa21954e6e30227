// tubectl keys: makes, renews and shows the keys of DDS Security.
#include <ctime>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "clients/tubectl/run/room_keys.hpp"
#include "clients/tubectl/verbs.hpp"
#include "idl/certificate.hpp"
#include "idl/utc_time.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kDefaultDays = 365;

struct KeysArguments {
  std::string folder;
  std::string room;
  std::string role;
  std::string name;
  std::string which;
  std::int64_t days = kDefaultDays;
  std::string until;
  bool as_json = false;
};

Period asked_period(const KeysArguments& arguments) {
  Period period = period_of(std::time(nullptr), arguments.days);
  if (!arguments.until.empty()) {
    const std::optional<std::int64_t> until_s = utc_from_text(arguments.until);
    if (!until_s) throw RoomError("'" + arguments.until + "' is no time: write 2027-01-31T12:00:00Z, in UTC");
    period.until_s = *until_s;
  }
  return period;
}

void say_where_it_goes(const KeysArguments& arguments, const std::string& until) {
  const std::string& folder = arguments.folder;
  std::cout << "Made " << folder << ", keys valid until " << until << ":\n"
            << "  " << folder << "/daemon      to the daemon's machine, as root:\n"
            << "      install -d -m 0750 -g tubed /etc/tubed/keys && install -m 0640 -g tubed " << folder
            << "/daemon/* /etc/tubed/keys/\n"
            << "      and in /etc/tubed/tubed.toml, [dds]: security = \"/etc/tubed/keys\", partition = \""
            << arguments.room << "\"\n"
            << "  " << folder << "/subscriber  to whoever reads: tubectl echo --security FOLDER; "
            << "Subscription::security\n"
            << "      one folder for each program: tubectl keys add " << folder << " subscriber NAME\n"
            << "  " << folder << "/" << kRoomMakerFolder
            << "  stays here: whoever has it makes keys that everybody in the room believes\n";
}

int run_make_room(const KeysArguments& arguments) {
  const Period period = asked_period(arguments);
  make_room(arguments.folder, arguments.room, period);
  say_where_it_goes(arguments, utc_text(period.until_s));
  return kExitOk;
}

int run_add(const KeysArguments& arguments) {
  const Period period = asked_period(arguments);
  add_identity(arguments.folder, role_named(arguments.role).value_or(Role::kSubscriber), arguments.name,
               period);
  std::cout << "Made " << arguments.folder << '/' << arguments.name << ", " << arguments.role
            << ", valid until " << utc_text(period.until_s) << '\n';
  return kExitOk;
}

int run_renew(const KeysArguments& arguments) {
  const Period period = asked_period(arguments);
  for (const std::string& name : renew_identities(arguments.folder, arguments.which, period)) {
    std::cout << "Renewed " << arguments.folder << '/' << name << ", valid until " << utc_text(period.until_s)
              << '\n';
  }
  std::cout
      << "Copy each to where it is used and restart what uses it. The old keys stay valid until their own "
         "end:\nwhere one was stolen, make a new room.\n";
  return kExitOk;
}

/// "good", "soon", "WRONG": what to do about it.
std::string verdict_of(const KeyExamination& found, std::int64_t now_s) {
  if (!found.problems.empty() || !found.holder) return "WRONG";
  return days_left(*found.holder, now_s) < kKeysEndSoonDays ? "soon" : "good";
}

nlohmann::json json_of(const ListedIdentity& listed, std::int64_t now_s) {
  nlohmann::json json{{"folder", listed.folder.string()},
                      {"verdict", verdict_of(listed.found, now_s)},
                      {"problems", listed.found.problems}};
  if (listed.found.holder) {
    const KeyHolder& holder = *listed.found.holder;
    json.update({{"name", holder.name},
                 {"role", holder.role},
                 {"room", holder.room},
                 {"valid_from", utc_text(holder.valid_from_s)},
                 {"valid_until", utc_text(holder.valid_until_s)},
                 {"days_left", days_left(holder, now_s)}});
  }
  return json;
}

void print(const ListedIdentity& listed, std::int64_t now_s) {
  std::string label = verdict_of(listed.found, now_s) + ":";
  label.resize(8, ' ');
  std::cout << label << listed.folder.string();
  if (listed.found.holder) {
    const KeyHolder& holder = *listed.found.holder;
    std::cout << ": " << holder.name << ", " << holder.role << " of " << holder.room << ", "
              << validity_words(holder, now_s);
  }
  std::cout << '\n';
  for (const std::string& problem : listed.found.problems) std::cout << "        " << problem << '\n';
  if (verdict_of(listed.found, now_s) == "soon") {
    std::cout << "        renew it: tubectl keys renew, then copy and restart\n";
  }
}

int run_show(const KeysArguments& arguments) {
  const std::int64_t now_s = std::time(nullptr);
  bool all_good = true;
  nlohmann::json list = nlohmann::json::array();
  for (const ListedIdentity& listed : identities_in(arguments.folder, now_s)) {
    all_good = all_good && listed.found.problems.empty();
    if (arguments.as_json) {
      list.push_back(json_of(listed, now_s));
    } else {
      print(listed, now_s);
    }
  }
  if (arguments.as_json) std::cout << list.dump(2) << '\n';
  return all_good ? kExitOk : kExitFailed;
}

using Run = int (*)(const KeysArguments&);

CommandLine add_part(CommandLine verb, const std::string& name, const std::string& meaning,
                     const std::shared_ptr<KeysArguments>& arguments, int& exit_code, Run run) {
  CommandLine part = verb.add_subcommand(name, meaning);
  part.add_option("FOLDER", arguments->folder, "The room's folder, on a machine of its maker").required();
  part.callback([arguments, &exit_code, run] {
    try {
      exit_code = run(*arguments);
    } catch (const CertificateError& error) {
      std::cerr << "tubectl: " << error.what() << '\n';
      exit_code = kExitBadData;
    }
  });
  return part;
}

void add_period(CommandLine part, KeysArguments& arguments) {
  Argument days = part.add_option("--days", arguments.days, "How long the keys are valid from now")
                      .in_range(1, 3649)
                      .capture_default_str();
  part.add_option("--until", arguments.until, "Until when instead, UTC: 2027-01-31 or 2027-01-31T12:00:00Z")
      .excludes(days);
}

}  // namespace

CommandLine add_keys(CommandLine app, int& exit_code) {
  CommandLine verb = app.add_subcommand("keys", "Make, renew and show the keys of DDS Security");
  verb.require_subcommand();
  const auto arguments = std::make_shared<KeysArguments>();
  CommandLine make = add_part(verb, "make-room", "Make authorities, and keys of a daemon and of a subscriber",
                              arguments, exit_code, run_make_room);
  make.add_option("--room", arguments->room, "[dds] partition of the daemon; empty = the default partition");
  add_period(make, *arguments);
  CommandLine add = add_part(verb, "add", "Make keys for one more program", arguments, exit_code, run_add);
  add.footer("Example:\n  tubectl keys add keys subscriber navigation");
  add.add_option("ROLE", arguments->role, "daemon publishes, subscriber only reads")
      .required()
      .is_member({"daemon", "subscriber"});
  add.add_option("NAME", arguments->name, "What it is called; its folder too").required();
  add_period(add, *arguments);
  CommandLine renew =
      add_part(verb, "renew", "Make new keys in the place of old ones", arguments, exit_code, run_renew);
  renew.footer("Example:\n  tubectl keys renew keys --days 365");
  renew.add_option("NAME", arguments->which, "This identity alone, or all of a role; left out = all");
  add_period(renew, *arguments);
  CommandLine show =
      add_part(verb, "show", "Say who has keys, for what and until when; exit 1 when one is unusable",
               arguments, exit_code, run_show);
  show.footer("Example:\n  tubectl keys show keys");
  show.add_flag("--json", arguments->as_json, "JSON instead of lines");
  return verb;
}

}  // namespace tubed
