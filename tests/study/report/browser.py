#!/usr/bin/env python3
"""Opens pages in headless Chromium by the DevTools protocol. Prints one JSON line per page: the
URLs that it requested, errors of its scripts and of its policy, and the value of --run."""

import argparse
import base64
import fcntl
import json
import os
import pathlib
import select
import signal
import subprocess
import sys
import tempfile
import time

READY = """(async () => {
  const figures = [...document.querySelectorAll("figure.chart, figure.view3d")];
  const isDrawn = (figure) => figure.hidden || figure.dataset.drawn === "yes";
  for (const figure of figures)
    for (let i = 0; i < 200 && !isDrawn(figure); ++i) {
      figure.scrollIntoView({behavior: "instant"});
      await new Promise((resolve) => setTimeout(resolve, 10));
    }
  scrollTo({top: 0, behavior: "instant"});
  return figures.length;
})()"""


class Browser:
    """Chromium that speaks DevTools over the pipes 3 and 4."""

    def __init__(self, program, profile, size, dark, deadline):
        self.deadline, self.events, self.buffer, self.last_id = deadline, [], b"", 0
        to_read, self.to = os.pipe()
        self.source, from_write = os.pipe()
        arguments = [
            program, "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--no-first-run",
            f"--user-data-dir={profile}", "--disable-dev-shm-usage", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--disable-background-networking", "--disable-sync",
            "--disable-component-update", "--mute-audio", f"--window-size={size}",
            "--force-device-scale-factor=1",
        ] + (["--blink-settings=preferredColorScheme=0"] if dark else [])

        def place_pipes():
            os.setsid()
            # Away from 3 and 4 first: a pipe may have one of these numbers.
            high_read = fcntl.fcntl(to_read, fcntl.F_DUPFD, 10)
            high_write = fcntl.fcntl(from_write, fcntl.F_DUPFD, 10)
            os.dup2(high_read, 3)
            os.dup2(high_write, 4)

        self.process = subprocess.Popen(arguments, preexec_fn=place_pipes, close_fds=False,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(from_write)

    def read(self):
        """The next message."""
        while b"\0" not in self.buffer:
            left = self.deadline - time.monotonic()
            if left <= 0 or not select.select([self.source], [], [], left)[0]:
                sys.exit("Chromium did not answer in time")
            piece = os.read(self.source, 1 << 20)
            if not piece:
                sys.exit("Chromium ended")
            self.buffer += piece
        message, _, self.buffer = self.buffer.partition(b"\0")
        return json.loads(message)

    def call(self, method, session=None, **parameters):
        self.last_id += 1
        message = {"id": self.last_id, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.read()
            if answer.get("id") == self.last_id:
                if "error" in answer:
                    sys.exit(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def wait_for(self, event):
        while not any(e.get("method") == event for e in self.events):
            self.events.append(self.read())

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="+", type=pathlib.Path)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--run", metavar="FILE", type=pathlib.Path,
                        help="a JavaScript expression; its value is printed as \"value\"")
    parser.add_argument("--screenshot", metavar="PNG", type=pathlib.Path, help="the whole page")
    parser.add_argument("--element", metavar="CSS", help="--screenshot shows only this element")
    parser.add_argument("--pdf", metavar="PDF", type=pathlib.Path, help="the page as it is printed")
    parser.add_argument("--dark", action="store_true")
    parser.add_argument("--size", default="1280,900", help="of the window, in pixels")
    parser.add_argument("--timeout", type=float, default=60, help="in s")
    return parser.parse_args()


def entries(events):
    """Requests, and errors of scripts and of the policy."""
    requests, errors = [], []
    for event in events:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Network.requestWillBeSent":
            requests.append(parameters["request"]["url"][:200])
        elif method == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning"):
            errors.append(" ".join(str(a.get("value", a.get("description")))
                                   for a in parameters["args"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            errors.append(parameters["entry"]["text"])
    return requests, errors


def visit(browser, page, arguments):
    """Opens the page in a new tab. Returns what the main program prints."""
    browser.events = []
    target = browser.call("Target.createTarget", url="about:blank")["targetId"]
    session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    for domain in ("Page", "Network", "Runtime", "Log"):
        browser.call(f"{domain}.enable", session)
    browser.call("Page.navigate", session, url=page.resolve().as_uri())
    browser.wait_for("Page.loadEventFired")

    def evaluate(text):
        answer = browser.call("Runtime.evaluate", session, expression=text, awaitPromise=True,
                              returnByValue=True)
        if "exceptionDetails" in answer:
            sys.exit(f"{page}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    # --pdf alone prints at once, as a reader may who has not scrolled through the page.
    if arguments.run or arguments.screenshot:
        evaluate(READY)
    value = evaluate(arguments.run.read_text()) if arguments.run else None
    if arguments.screenshot:
        shot = browser.call("Page.captureScreenshot", session, captureBeyondViewport=True,
                            clip=evaluate(clip_of(arguments.element or "html")))
        arguments.screenshot.write_bytes(base64.b64decode(shot["data"]))
    if arguments.pdf:
        pdf = browser.call("Page.printToPDF", session, preferCSSPageSize=True,
                           printBackground=True)
        arguments.pdf.write_bytes(base64.b64decode(pdf["data"]))
    requests, errors = entries(browser.events)
    browser.call("Target.closeTarget", targetId=target)
    return {"page": str(page), "requests": requests, "errors": errors, "value": value}


def main():
    arguments = parse()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(arguments.chromium, profile, arguments.size, arguments.dark,
                          time.monotonic() + arguments.timeout)
        try:
            for page in arguments.pages:
                print(json.dumps(visit(browser, page, arguments)), flush=True)
        finally:
            browser.end()


def clip_of(element):
    """An expression for the rectangle of the element, in pixels of the page."""
    return f"""(() => {{
      const box = document.querySelector({json.dumps(element)}).getBoundingClientRect();
      return {{x: box.x + scrollX, y: box.y + scrollY, width: box.width, height: box.height,
        scale: 1}};
    }})()"""


if __name__ == "__main__":
    main()
