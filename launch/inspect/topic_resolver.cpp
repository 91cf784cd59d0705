#include "launch/inspect/topic_resolver.h"

#include <algorithm>

#include "common/base/regex.h"
#include "common/base/text_table.h"

namespace fivepipe::launch {
namespace {

std::vector<std::string> matching_topics(const std::string& expression,
                                         const std::vector<std::string>& topics) {
  std::vector<std::string> found;
  try {
    const base::Regex wanted(expression, base::Regex::Case::ignored);
    for (const std::string& topic : topics)
      if (wanted.found_in(topic)) found.push_back(topic);
  } catch (const base::RegexError& error) {
    throw base::UsageError("'" + expression + "' is neither a topic nor a regular expression (" +
                           error.what() + ")");
  }
  return found;
}

}  // namespace

std::string base_name(const std::string& topic) { return topic.substr(topic.rfind('/') + 1); }

std::string resolve_topic(const std::string& text, const std::vector<std::string>& topics) {
  std::vector<std::string> found;
  if (std::find(topics.begin(), topics.end(), text) != topics.end()) return text;
  std::copy_if(topics.begin(), topics.end(), std::back_inserter(found),
               [&](const std::string& topic) { return base_name(topic) == text; });
  if (found.empty()) found = matching_topics(text, topics);
  if (found.size() == 1) return found.front();
  if (topics.empty()) throw base::UsageError("no topic '" + text + "'; there are no topics");
  if (found.empty())
    throw base::UsageError("no topic '" + text + "'; the topics are:\n  " +
                           base::printable(base::joined(topics, ", ")));
  throw base::UsageError("'" + text + "' matches several topics:\n  " +
                         base::printable(base::joined(found, ", ")));
}

}  // namespace fivepipe::launch
