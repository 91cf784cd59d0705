#include "launch/keys/documents.h"

#include <fmt/format.h>

namespace fivepipe::keys {
namespace {

constexpr const char* kHead =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation=
"http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_{}.xsd">
)";

constexpr const char* kGovernance = R"(  <domain_access_rules>
    <domain_rule>
      <domains><id>{domain}</id></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>{kind}</discovery_protection_kind>
      <liveliness_protection_kind>{kind}</liveliness_protection_kind>
      <rtps_protection_kind>NONE</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>{kind}</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)";

constexpr const char* kPermissions = R"(  <permissions>
    <grant name="{name}">
      <subject_name>{name}</subject_name>
      <validity>
        <not_before>{from}</not_before>
        <not_after>{until}</not_after>
      </validity>
      <allow_rule>
        <domains><id>{domain}</id></domains>
{rules}      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)";

std::string rule_xml(const char* element, const std::vector<std::string>& topics) {
  if (topics.empty()) return "";
  std::string xml = fmt::format("        <{}>\n          <topics>\n", element);
  for (const std::string& topic : topics)
    xml += fmt::format("            <topic>{}</topic>\n", topic);
  return xml + fmt::format("          </topics>\n        </{}>\n", element);
}

}  // namespace

// metadata_protection_kind protects each submessage once, header and content. Protecting the
// payload, too, would encrypt the content twice.
std::string governance_xml(std::uint32_t domain, security::Protection protection) {
  return fmt::format(kHead, "governance") +
         fmt::format(
             kGovernance, fmt::arg("domain", domain),
             fmt::arg("kind", protection == security::Protection::sign ? "SIGN" : "ENCRYPT"));
}

std::string permissions_xml(const std::string& subject, std::uint32_t domain, Validity validity,
                            const RoleTopics& topics) {
  return fmt::format(kHead, "permissions") +
         fmt::format(kPermissions, fmt::arg("name", subject),
                     fmt::arg("from", security::iso_text(validity.from_s)),
                     fmt::arg("until", security::iso_text(validity.until_s)),
                     fmt::arg("domain", domain),
                     fmt::arg("rules", rule_xml("publish", topics.publishes) +
                                           rule_xml("subscribe", topics.subscribes)));
}

}  // namespace fivepipe::keys
