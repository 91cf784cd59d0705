// The folder of keys and what the checks of its files report.
#include "launch/keys/make_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "launch/keys/authority.h"
#include "launch/keys/documents.h"
#include "tests/support/optional_package.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::keys {
namespace {

namespace fs = std::filesystem;
using security::check_role;
using security::kDay_s;
using security::Protection;
using security::Role;
using security::RoleFiles;
using security::SecurityError;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kNow_s = 1'800'000'000;  // in January 2027
constexpr std::uint32_t kDomain = 7;

std::string content_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}
mode_t mode_of(const fs::path& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
  return status.st_mode & 07777;
}

class Keys : public testing::Test {
 protected:
  MadeKeys make(std::optional<Protection> protection = {}, int days = 365,
                std::int64_t now_s = kNow_s, bool new_ca = false) {
    return make_keys({keys_, "lab", kDomain, protection, days, new_ca, now_s});
  }
  RoleFiles files(Role role) const { return {keys_ / name_of(role), role}; }
  std::string problem_of_making(std::int64_t now_s = kNow_s) {
    try {
      make({}, 365, now_s);
    } catch (const SecurityError& error) {
      return error.what();
    }
    return "";
  }
  std::string problem_of(Role role, std::int64_t now_s = kNow_s,
                         const std::string& deployment = "lab",
                         std::uint32_t domain = kDomain) const {
    try {
      check_role(files(role), deployment, domain, now_s);
    } catch (const SecurityError& error) {
      return error.what();
    }
    return "";
  }
  const test::TestFolder folder_;
  const fs::path keys_ = folder_.path / "deep" / "keys";
};

TEST_F(Keys, EveryRoleHasValidFiles) {
  const MadeKeys made = make();
  EXPECT_TRUE(made.made_ca);
  EXPECT_EQ(made.until_s, kNow_s + 365 * kDay_s);
  for (const Role role : security::kRoles) {
    const security::CheckedRole checked = check_role(files(role), "lab", kDomain, kNow_s);
    EXPECT_EQ(checked.protection, Protection::encrypt) << "the default";
    EXPECT_EQ(checked.not_after_s, made.until_s);
    EXPECT_THAT(checked.warnings, IsEmpty());
  }
}

TEST_F(Keys, OnlyTheOwnerReadsPrivateKeys) {
  const mode_t before = umask(0);
  make();
  umask(before);
  EXPECT_EQ(mode_of(keys_), 0700u);
  EXPECT_EQ(mode_of(keys_ / "ca"), 0700u);
  EXPECT_EQ(mode_of(keys_ / "ca/ca-key.pem"), 0600u);
  EXPECT_EQ(mode_of(keys_ / "ca/permissions-ca-key.pem"), 0600u);
  for (const Role role : security::kRoles) {
    EXPECT_EQ(mode_of(files(role).folder), 0700u);
    EXPECT_EQ(mode_of(files(role).key()), 0600u);
  }
}

TEST_F(Keys, AKeyThatOthersReadIsAWarning) {
  make();
  fs::permissions(files(Role::sim).key(), fs::perms(0640));
  EXPECT_THAT(check_role(files(Role::sim), "lab", kDomain, kNow_s).warnings,
              ElementsAre(HasSubstr("other users can read " + files(Role::sim).key().string())));
}

TEST_F(Keys, ASecondRunKeepsTheCaAndTheProtectionAndRenewsTheIdentities) {
  make(Protection::sign, 10);
  const std::string ca = content_of(keys_ / "ca/ca.pem"),
                    old = content_of(files(Role::recon).identity());
  const MadeKeys made = make({}, 365, kNow_s + 5 * kDay_s);
  EXPECT_FALSE(made.made_ca);
  EXPECT_EQ(made.protection, Protection::sign);
  EXPECT_EQ(content_of(keys_ / "ca/ca.pem"), ca);
  EXPECT_EQ(content_of(files(Role::recon).ca()), ca);
  EXPECT_NE(content_of(files(Role::recon).identity()), old);
  EXPECT_EQ(check_role(files(Role::recon), "lab", kDomain, kNow_s + 300 * kDay_s).not_after_s,
            kNow_s + 370 * kDay_s);
  EXPECT_EQ(make(Protection::encrypt).protection, Protection::encrypt);
}

TEST_F(Keys, OldAndNewFilesOfOneCaDoNotMixWithThoseOfAnother) {
  make();
  const std::string identity = content_of(files(Role::render).identity()),
                    key = content_of(files(Role::render).key()),
                    permissions = content_of(files(Role::render).permissions());
  make();
  // A new identity with the old key.
  std::ofstream(files(Role::render).key()) << key;
  EXPECT_THAT(problem_of(Role::render), HasSubstr("key.pem: not the key of"));
  EXPECT_TRUE(make({}, 365, kNow_s, true).made_ca);
  EXPECT_EQ(problem_of(Role::render), "");
  std::ofstream(files(Role::render).permissions()) << permissions;
  EXPECT_THAT(problem_of(Role::render), HasSubstr("permissions.p7s: not signed by the CA"));
  std::ofstream(files(Role::render).identity()) << identity;
  EXPECT_THAT(problem_of(Role::render), HasSubstr("identity.pem: not signed by"));
}

TEST_F(Keys, ExpiryIsReportedBeforeAndAfter) {
  make({}, 60);
  const std::int64_t end_s = kNow_s + 60 * kDay_s;
  EXPECT_THAT(check_role(files(Role::capture), "lab", kDomain, end_s - 31 * kDay_s).warnings,
              IsEmpty());
  EXPECT_THAT(check_role(files(Role::capture), "lab", kDomain, end_s - 29 * kDay_s).warnings,
              ElementsAre(files(Role::capture).identity().string() + " expires at " +
                          security::utc_text(end_s) + ", in 29 days"));
  EXPECT_THAT(check_role(files(Role::capture), "lab", kDomain, end_s - 90 * 60).warnings,
              ElementsAre(HasSubstr(", in 1 hour")));
  EXPECT_EQ(problem_of(Role::capture, end_s - 1), "");
  EXPECT_THAT(problem_of(Role::capture, end_s),
              HasSubstr("identity.pem: expired at " + security::utc_text(end_s)));
  EXPECT_THAT(problem_of(Role::capture, kNow_s - 2 * kDay_s), HasSubstr("valid only from"));
}

TEST_F(Keys, FilesOfAnotherRoleDeploymentOrDomainAreNamed) {
  make();
  EXPECT_THAT(
      problem_of(Role::capture, kNow_s, "other"),
      HasSubstr("identity.pem: belongs to 'CN=capture of lab', not to 'CN=capture of other'"));
  EXPECT_THAT(problem_of(Role::capture, kNow_s, "lab", 8),
              HasSubstr("permissions.p7s: made for DDS domain 7, not for domain 8"));
  fs::copy_file(files(Role::commands).permissions(), files(Role::capture).permissions(),
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(problem_of(Role::capture),
              HasSubstr("permissions.p7s: belongs to 'CN=commands of lab', not to 'CN=capture of "
                        "lab'"));
}

TEST_F(Keys, MissingAndDamagedFilesAreNamed) {
  for (const auto& file : files(Role::observer).all()) {
    make();
    fs::remove(file);
    EXPECT_THAT(problem_of(Role::observer), HasSubstr(file.string() + ": there is no such file"));
    make();
    std::ofstream(file) << "text";
    EXPECT_THAT(problem_of(Role::observer), HasSubstr(file.string() + ": no ")) << file;
  }
}

// The signature covers the text.
TEST_F(Keys, AChangedDocumentIsRefused) {
  make();
  const fs::path permissions = files(Role::capture).permissions();
  const std::string text = content_of(permissions);
  std::ofstream(permissions) << test::replaced(text, "HeadPose", "Command");
  EXPECT_THAT(problem_of(Role::capture), HasSubstr("permissions.p7s: not signed by the CA"));
}

TEST_F(Keys, KeysDoNotOutliveTheCa) {
  make();
  EXPECT_THAT(problem_of_making(kNow_s + 3300 * kDay_s), HasSubstr("the CA expires at"));
  EXPECT_EQ(check_role(files(Role::sim), "lab", kDomain, kNow_s).not_after_s, kNow_s + 365 * kDay_s)
      << "the old keys stay";
}

TEST_F(Keys, AMissingCaKeyIsAnErrorAndNotANewCa) {
  for (const char* file : {"ca-key.pem", "permissions-ca-key.pem", "permissions-ca.pem"}) {
    make({}, 365, kNow_s, true);
    fs::remove(keys_ / "ca" / file);
    EXPECT_THAT(problem_of_making(), AllOf(HasSubstr(file), HasSubstr("--force"))) << file;
    EXPECT_EQ(problem_of(Role::sim), "");
  }
}

// The protection of signed keys must not change to encryption by accident.
TEST_F(Keys, AnUnknownProtectionIsAnError) {
  make(Protection::sign);
  fs::remove(keys_ / "ca/governance.p7s");
  fs::remove_all(keys_ / "supervisor");
  EXPECT_THAT(problem_of_making(), HasSubstr("--protection sign or --protection encrypt"));
  EXPECT_EQ(make(Protection::sign).protection, Protection::sign);
  EXPECT_EQ(make().protection, Protection::sign);
}

TEST_F(Keys, TheFirstEndOfAllFilesCounts) {
  make();
  const Authority authority(keys_ / "ca/permissions-ca.pem", keys_ / "ca/permissions-ca-key.pem");
  const auto write = [&](std::int64_t from_s, std::int64_t until_s) {
    std::ofstream(files(Role::sim).permissions()) << authority.signed_document(permissions_xml(
        subject_of(Role::sim, "lab"), kDomain, {from_s, until_s}, topics_of(Role::sim)));
  };
  write(kNow_s, kNow_s + 10 * kDay_s);
  const security::CheckedRole checked = check_role(files(Role::sim), "lab", kDomain, kNow_s);
  EXPECT_EQ(checked.not_after_s, kNow_s + 10 * kDay_s);
  EXPECT_THAT(checked.warnings,
              ElementsAre(HasSubstr(files(Role::sim).permissions().string() + " expires at")));
  EXPECT_THAT(problem_of(Role::sim, kNow_s + 10 * kDay_s),
              HasSubstr("permissions.p7s: expired at"));
  write(kNow_s + 1, kNow_s + kDay_s);
  EXPECT_THAT(problem_of(Role::sim), HasSubstr("permissions.p7s: valid only from"));
}

// Cyclone DDS accepts each signer of a document that the CA of the permissions has certified, and a
// program need not check its own files.
TEST_F(Keys, ARoleCannotSignPermissions) {
  make();
  const Authority role(files(Role::tracker).identity(), files(Role::tracker).key());
  const std::string forged = role.signed_document(permissions_xml(
      subject_of(Role::tracker, "lab"), kDomain, {kNow_s, kNow_s + kDay_s}, {{"*"}, {"*"}}));
  const auto is_accepted_by_cyclone = [&](const std::string& document, const fs::path& ca_file) {
    const security::Bio bio(BIO_new_mem_buf(document.data(), int(document.size())));
    BIO* detached = nullptr;
    const security::Pkcs7 signature(SMIME_read_PKCS7(bio.get(), &detached));
    const security::Bio content(detached), text(BIO_new(BIO_s_mem()));
    const security::X509Handle ca = security::read_certificate(ca_file);
    const std::unique_ptr<X509_STORE, security::FreeWith<X509_STORE_free>> store(X509_STORE_new());
    X509_STORE_add_cert(store.get(), ca.get());
    X509_VERIFY_PARAM_set_time(X509_STORE_get0_param(store.get()), kNow_s);
    const bool accepted = PKCS7_verify(signature.get(), nullptr, store.get(), content.get(),
                                       text.get(), PKCS7_TEXT) == 1;
    security::take_openssl_error();
    return accepted;
  };
  const RoleFiles peer = files(Role::sim);
  EXPECT_FALSE(is_accepted_by_cyclone(forged, peer.permissions_ca()));
  EXPECT_TRUE(is_accepted_by_cyclone(content_of(peer.permissions()), peer.permissions_ca()));
  EXPECT_TRUE(is_accepted_by_cyclone(forged, peer.ca())) << "so one CA for both is not enough";
}

TEST_F(Keys, ANewCaKeepsTheProtection) {
  make(Protection::sign);
  const MadeKeys made = make({}, 365, kNow_s, true);
  EXPECT_TRUE(made.made_ca);
  EXPECT_EQ(made.protection, Protection::sign);
}

// On a file system without an exchange at once, the old folder has another name for a moment.
TEST_F(Keys, AnInterruptedExchangeOfTheCaIsCompleted) {
  make();
  const std::string ca = content_of(keys_ / "ca/ca.pem");
  fs::rename(keys_ / "ca", keys_ / "ca.old");
  EXPECT_FALSE(make().made_ca);
  EXPECT_EQ(content_of(keys_ / "ca/ca.pem"), ca);
}

TEST_F(Keys, AnInterruptedRunLeavesWholeFolders) {
  make();
  fs::create_directories(keys_ / "sim.new");
  std::ofstream(keys_ / "sim.new/key.pem") << "half";
  make();
  EXPECT_EQ(problem_of(Role::sim), "");
  EXPECT_FALSE(fs::exists(keys_ / "sim.new"));
}

// As root, renewed keys stay readable for the user of the service.
TEST_F(Keys, RenewedKeysKeepTheirOwner) {
  if (geteuid() != 0) FIVEPIPE_SKIP_WITHOUT_PACKAGE("needs root");
  make();
  constexpr uid_t kUser = 12345;
  ASSERT_EQ(chown(files(Role::sim).folder.c_str(), kUser, kUser), 0);
  make();
  for (const fs::path& path : {files(Role::sim).folder, files(Role::sim).key()}) {
    struct stat status {};
    ASSERT_EQ(stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_uid, kUser) << path;
  }
  EXPECT_EQ(mode_of(files(Role::sim).key()), 0600u);
}

TEST_F(Keys, AFolderThatCannotBeMadeIsNamed) {
  fs::create_directories(keys_.parent_path());
  std::ofstream(keys_) << "a file";
  EXPECT_THAT(problem_of_making(), HasSubstr(keys_.string()));
}

TEST(Documents, GovernanceAdmitsOnlyAuthenticatedParticipants) {
  for (const auto& [protection, kind] :
       {std::pair(Protection::sign, "SIGN"), {Protection::encrypt, "ENCRYPT"}}) {
    const std::string xml = governance_xml(7, protection);
    for (const auto& [element, value] : {std::pair<const char*, std::string>("id", "7"),
                                         {"allow_unauthenticated_participants", "false"},
                                         {"enable_join_access_control", "true"},
                                         {"discovery_protection_kind", kind},
                                         {"liveliness_protection_kind", kind},
                                         {"topic_expression", "*"},
                                         {"enable_discovery_protection", "true"},
                                         {"enable_read_access_control", "true"},
                                         {"enable_write_access_control", "true"},
                                         {"enable_liveliness_protection", "true"},
                                         {"rtps_protection_kind", "NONE"},
                                         {"data_protection_kind", "NONE"},
                                         {"metadata_protection_kind", kind}})
      EXPECT_EQ(security::element_of(xml, element), value) << element;
  }
}

TEST(Documents, PermissionsDenyByDefaultAndListTheTopicsOnce) {
  const std::string xml = permissions_xml("CN=x of lab", 7, {0, kDay_s}, {{"a", "b"}, {"c"}});
  EXPECT_EQ(security::element_of(xml, "default"), "DENY");
  EXPECT_EQ(security::element_of(xml, "subject_name"), "CN=x of lab");
  EXPECT_EQ(security::element_of(xml, "id"), "7");
  EXPECT_EQ(security::element_of(xml, "not_before"), "1970-01-01T00:00:00Z");
  EXPECT_EQ(security::element_of(xml, "not_after"), "1970-01-02T00:00:00Z");
  const std::string publish = security::element_of(xml, "publish"),
                    subscribe = security::element_of(xml, "subscribe");
  for (const char* topic : {"<topic>a</topic>", "<topic>b</topic>"})
    EXPECT_THAT(publish, HasSubstr(topic));
  EXPECT_THAT(publish, testing::Not(HasSubstr("<topic>c")));
  EXPECT_EQ(security::element_of(subscribe, "topic"), "c");
  const std::string none = permissions_xml("CN=x of lab", 7, {0, kDay_s}, {{}, {"c"}});
  EXPECT_THAT(none, testing::Not(HasSubstr("<publish>"))) << "an empty list would allow all";
}

}  // namespace
}  // namespace fivepipe::keys
