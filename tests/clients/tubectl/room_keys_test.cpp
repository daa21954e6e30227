#include "clients/tubectl/run/room_keys.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <fstream>

#include "idl/certificate.hpp"
#include "idl/dds_contract.hpp"
#include "idl/utc_time.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

class RoomKeys : public testing::Test {
 protected:
  RoomKeys() {
    std::string name = (fs::temp_directory_path() / "tubed-keys-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    room_ = folder_ / "room";
  }
  ~RoomKeys() override { fs::remove_all(folder_); }
  RoomKeys(const RoomKeys&) = delete;
  RoomKeys& operator=(const RoomKeys&) = delete;

  [[nodiscard]] KeyExamination examined(const std::string& name, std::int64_t days_later = 0) const {
    return examine_keys(room_ / name, now_s_ + days_later * kSecondsPerDay);
  }
  /// Whether exactly one problem was found and its words have all of `parts`.
  static void expect_problem(const KeyExamination& found, const std::vector<std::string>& parts) {
    ASSERT_EQ(found.problems.size(), 1U) << testing::PrintToString(found.problems);
    for (const std::string& part : parts)
      EXPECT_NE(found.problems[0].find(part), std::string::npos) << found.problems[0];
  }
  static bool openssl(const std::string& arguments) {
    return std::system(("openssl " + arguments + " >/dev/null 2>&1").c_str()) == 0;
  }
  static unsigned mode_of(const fs::path& file) {
    struct stat status {};
    return ::stat(file.c_str(), &status) == 0 ? status.st_mode & 07777U : 0;
  }

  std::int64_t now_s_ = std::time(nullptr);
  Period year_ = period_of(now_s_, 365);
  fs::path folder_;
  fs::path room_;
};

TEST_F(RoomKeys, OpensslItselfBelievesTheCertificatesAndTheSignatures) {
  if (!openssl("version")) GTEST_SKIP() << "no openssl: apt-get install openssl";
  make_room(room_, "OR-3", year_);
  for (const char* name : {"daemon", "subscriber"}) {
    const std::string place = (room_ / name).string() + "/";
    EXPECT_TRUE(
        openssl("verify -x509_strict -CAfile " + place + "identity_ca.pem " + place + "identity.pem"));
    EXPECT_FALSE(openssl("verify -CAfile " + place + "permissions_ca.pem " + place + "identity.pem"));
    for (const char* document : {"permissions.p7s", "governance.p7s"}) {
      EXPECT_TRUE(
          openssl("smime -verify -text -CAfile " + place + "permissions_ca.pem -in " + place + document));
      EXPECT_FALSE(
          openssl("smime -verify -text -CAfile " + place + "identity_ca.pem -in " + place + document));
    }
  }
}

TEST_F(RoomKeys, ASubscriberMayReadEveryTopicOfItsRoomAndPublishNone) {
  make_room(room_, "OR-3", year_);
  const KeyHolder subscriber = examined("subscriber").holder.value();
  for (const std::string& topic : topic_names()) {
    EXPECT_TRUE(allows(subscriber.grant, Access::kSubscribe, topic, "OR-3")) << topic;
    EXPECT_FALSE(allows(subscriber.grant, Access::kSubscribe, topic, "")) << topic;
    EXPECT_FALSE(allows(subscriber.grant, Access::kPublish, topic, "OR-3")) << topic;
  }
  const Certificate authority = read_certificate(room_ / "subscriber" / kPermissionsCaFile);
  const std::string document = read_signed_document(room_ / "subscriber" / kPermissionsFile, authority);
  EXPECT_EQ(document.find("<publish>"), std::string::npos) << document;
  EXPECT_NE(document.find("<default>DENY</default>"), std::string::npos) << document;
}

TEST_F(RoomKeys, ADaemonMayPublishAndReadEveryTopicOfItsRoomAlone) {
  make_room(room_, "", year_);
  const KeyHolder daemon = examined("daemon").holder.value();
  for (const std::string& topic : topic_names()) {
    EXPECT_TRUE(allows(daemon.grant, Access::kPublish, topic, "")) << topic;
    EXPECT_TRUE(allows(daemon.grant, Access::kSubscribe, topic, "")) << topic;
    EXPECT_FALSE(allows(daemon.grant, Access::kPublish, topic, "OR-3")) << topic;
  }
  EXPECT_FALSE(allows(daemon.grant, Access::kPublish, "rt/anything", ""));
}

TEST_F(RoomKeys, GovernanceLetsNobodyInWithoutKeysAndProtectsEverything) {
  const std::string governance = governance_document();
  EXPECT_NE(governance.find("<allow_unauthenticated_participants>false<"), std::string::npos);
  EXPECT_NE(governance.find("<enable_join_access_control>true<"), std::string::npos);
  EXPECT_EQ(governance.find("NONE"), std::string::npos);
  // Keys for all receivers alike would let one subscriber speak to another in the daemon's name.
  for (const char* kind : {"discovery", "liveliness", "rtps", "metadata"}) {
    const std::size_t at = governance.find(std::string("<") + kind + "_protection_kind>");
    EXPECT_EQ(governance.find("_WITH_ORIGIN_AUTHENTICATION</", at), governance.find("</", at) - 27) << kind;
  }
  // Of each topic discovery, liveliness, reading and writing; then the participant's join.
  EXPECT_EQ(governance.find(">false<", governance.find("enable_join")), std::string::npos);
}

TEST_F(RoomKeys, PrivateKeysAreTheirOwnersAlone) {
  make_room(room_, "", year_);
  for (const char* key : {"daemon/identity.key", "subscriber/identity.key", "room-maker/identity_ca.key",
                          "room-maker/permissions_ca.key"}) {
    EXPECT_EQ(mode_of(room_ / key), 0600U) << key;
  }
  EXPECT_EQ(mode_of(room_ / "room-maker"), 0700U);
  EXPECT_FALSE(fs::exists(room_ / "daemon" / "identity_ca.key"));
}

TEST_F(RoomKeys, NothingIsOverwritten) {
  make_room(room_, "", year_);
  EXPECT_THROW(make_room(room_, "", year_), RoomError);
  EXPECT_THROW(add_identity(room_, Role::kSubscriber, "subscriber", year_), RoomError);
  add_identity(room_, Role::kSubscriber, "view-1", year_);
  EXPECT_TRUE(examined("view-1").problems.empty());
  EXPECT_EQ(examined("view-1").holder->name, "view-1");
}

TEST_F(RoomKeys, NamesThatWouldLeaveTheFolderOrTheXmlAreRefused) {
  EXPECT_THROW(make_room(room_, "<partition>", year_), RoomError);
  EXPECT_THROW(make_room(room_, "*", year_), RoomError);
  EXPECT_FALSE(fs::exists(room_));
  make_room(room_, "", year_);
  for (const char* name : {"", "../x", "room-maker", ".hidden", "a/b", "a b"}) {
    EXPECT_THROW(add_identity(room_, Role::kSubscriber, name, year_), RoomError) << name;
  }
}

TEST_F(RoomKeys, KeysOutliveNeitherTheirAuthorityNorThemselves) {
  EXPECT_THROW(make_room(room_, "", {now_s_, now_s_}), RoomError);
  make_room(room_, "", year_);
  EXPECT_THROW(add_identity(room_, Role::kSubscriber, "late", period_of(now_s_, kAuthorityDays + 10)),
               RoomError);
}

TEST_F(RoomKeys, RenewingMakesNewKeysOfTheSameIdentityAndLeavesOthersAlone) {
  make_room(room_, "OR-3", period_of(now_s_, 10));
  const std::string daemon_before = file_text(room_ / "daemon" / kPrivateKeyFile);
  const std::string subscriber_before = file_text(room_ / "subscriber" / kPrivateKeyFile);
  EXPECT_EQ(renew_identities(room_, "daemon", year_), std::vector<std::string>{"daemon"});
  const KeyExamination renewed = examined("daemon");
  EXPECT_TRUE(renewed.problems.empty()) << testing::PrintToString(renewed.problems);
  EXPECT_EQ(days_left(*renewed.holder, now_s_), 365);
  EXPECT_EQ(renewed.holder->role, "daemon");
  EXPECT_TRUE(allows(renewed.holder->grant, Access::kPublish, "TubeEstimate", "OR-3"));
  EXPECT_NE(file_text(room_ / "daemon" / kPrivateKeyFile), daemon_before);
  EXPECT_EQ(file_text(room_ / "subscriber" / kPrivateKeyFile), subscriber_before);
  EXPECT_EQ(renew_identities(room_, "", year_), (std::vector<std::string>{"daemon", "subscriber"}));
  EXPECT_THROW(renew_identities(room_, "nobody", year_), RoomError);
}

TEST_F(RoomKeys, GoodKeysHaveNoProblem) {
  make_room(room_, "OR-3", year_);
  const KeyExamination found = examined("daemon");
  EXPECT_TRUE(found.problems.empty()) << testing::PrintToString(found.problems);
  EXPECT_EQ(found.holder->room, "OR-3");
  EXPECT_EQ(found.holder->valid_until_s, year_.until_s);
  EXPECT_EQ(found.holder->valid_from_s, year_.from_s);
}

TEST_F(RoomKeys, ExpiredKeysAreToldWithTheTimeAndWhatToDo) {
  make_room(room_, "", year_);
  const KeyExamination found = examined("daemon", 366);
  ASSERT_EQ(found.problems.size(), 2U) << testing::PrintToString(found.problems);  // certificate, permissions
  for (const std::string& problem : found.problems) {
    EXPECT_NE(problem.find("expired " + utc_text(year_.until_s)), std::string::npos) << problem;
    EXPECT_NE(problem.find("tubectl keys renew"), std::string::npos) << problem;
  }
  EXPECT_EQ(validity_words(*found.holder, now_s_ + 366 * kSecondsPerDay),
            "expired " + utc_text(year_.until_s));
}

TEST_F(RoomKeys, KeysThatAreNotValidYetPointToTheClock) {
  make_room(room_, "", year_);
  const KeyExamination found = examined("daemon", -2);
  ASSERT_FALSE(found.problems.empty());
  EXPECT_NE(found.problems[0].find("not valid before"), std::string::npos) << found.problems[0];
  EXPECT_NE(found.problems[0].find("clock"), std::string::npos) << found.problems[0];
}

TEST_F(RoomKeys, AMissingFolderOrFileIsNamed) {
  expect_problem(examined("nowhere"), {(room_ / "nowhere").string(), "make-room"});
  make_room(room_, "", year_);
  for (const char* file :
       {kIdentityCaFile, kCertificateFile, kPrivateKeyFile, kGovernanceFile, kPermissionsFile}) {
    const fs::path path = room_ / "daemon" / file;
    fs::rename(path, folder_ / "aside");
    expect_problem(examined("daemon"), {path.string(), "No such file", "copy all files"});
    fs::rename(folder_ / "aside", path);
  }
}

TEST_F(RoomKeys, AKeyThatOthersMayUseIsRefused) {
  make_room(room_, "", year_);
  const fs::path key = room_ / "daemon" / kPrivateKeyFile;
  ::chmod(key.c_str(), 0644);
  expect_problem(examined("daemon"), {key.string(), "0644", "chmod"});
  ::chmod(key.c_str(), 0640);
  EXPECT_TRUE(examined("daemon").problems.empty());
}

TEST_F(RoomKeys, FilesOfTwoIdentitiesDoNotMatch) {
  make_room(room_, "", year_);
  const fs::path daemon = room_ / "daemon";
  const fs::path subscriber = room_ / "subscriber";
  fs::copy_file(subscriber / kPrivateKeyFile, daemon / kPrivateKeyFile, fs::copy_options::overwrite_existing);
  expect_problem(examined("daemon"), {kPrivateKeyFile, "does not belong to"});
  fs::copy_file(daemon / kPermissionsFile, subscriber / kPermissionsFile,
                fs::copy_options::overwrite_existing);
  expect_problem(examined("subscriber"), {kPermissionsFile, "no grant for CN=subscriber"});
}

TEST_F(RoomKeys, FilesOfTwoRoomsDoNotMatch) {
  make_room(room_, "", year_);
  make_room(folder_ / "other", "", year_);
  for (const char* file : {kIdentityCaFile, kGovernanceFile}) {
    const fs::path path = room_ / "daemon" / file;
    fs::rename(path, folder_ / "aside");
    fs::copy_file(folder_ / "other" / "daemon" / file, path);
    expect_problem(examined("daemon"), {"signed by"});
    fs::remove(path);
    fs::rename(folder_ / "aside", path);
  }
}

TEST_F(RoomKeys, ADocumentThatWasChangedIsRefused) {
  make_room(room_, "", year_);
  const fs::path file = room_ / "subscriber" / kPermissionsFile;
  std::string text = file_text(file);
  for (std::size_t at = 0; (at = text.find("subscribe>", at)) != std::string::npos;)
    text.replace(at, 10, "publish>");
  std::ofstream(file) << text;
  expect_problem(examined("subscriber"), {file.string(), "changed afterwards"});
}

TEST_F(RoomKeys, ThePartitionThatKeysAreForIsTold) {
  make_room(room_, "OR-3", year_);
  const KeyHolder holder = examined("daemon").holder.value();
  EXPECT_EQ(refusal_of(holder, "keys", Access::kPublish, topic_names(), "OR-3"), "");
  const std::string refusal = refusal_of(holder, "keys", Access::kPublish, topic_names(), "OR-4");
  EXPECT_NE(refusal.find("partition 'OR-4' (it may in partition 'OR-3')"), std::string::npos) << refusal;
  const KeyHolder subscriber = examined("subscriber").holder.value();
  const std::string role = refusal_of(subscriber, "keys", Access::kPublish, topic_names(), "OR-3");
  EXPECT_NE(role.find("its role, subscriber, may not publish at all"), std::string::npos) << role;
}

TEST_F(RoomKeys, ARoomListsItsIdentitiesAndAnIdentityItself) {
  make_room(room_, "", year_);
  add_identity(room_, Role::kSubscriber, "a-display", year_);
  const std::vector<ListedIdentity> listed = identities_in(room_, now_s_);
  ASSERT_EQ(listed.size(), 3U);
  EXPECT_EQ(listed[0].found.holder->name, "a-display");
  EXPECT_EQ(identities_in(room_ / "daemon", now_s_).size(), 1U);
  EXPECT_THROW((void)identities_in(folder_, now_s_), RoomError);
}

}  // namespace
}  // namespace tubed
