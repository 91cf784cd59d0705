#!/usr/bin/python3
"""An RTSP camera on the loopback interface, until it is killed: rtsp_server.py PORT PIPELINE.

PIPELINE ends with a payloader named pay0. Prints "ready"; without GStreamer's RTSP server, prints
what is missing and exits with code 3.
"""
import sys

try:
    import gi

    gi.require_version("Gst", "1.0")
    gi.require_version("GstRtspServer", "1.0")
    from gi.repository import GLib, Gst, GstRtspServer
except (ImportError, ValueError) as error:
    print(error)
    sys.exit(3)

Gst.init(None)
server = GstRtspServer.RTSPServer()
server.set_address("127.0.0.1")
server.set_service(sys.argv[1])
factory = GstRtspServer.RTSPMediaFactory()
factory.set_launch(sys.argv[2])
factory.set_shared(True)
server.get_mount_points().add_factory("/camera", factory)
if not server.attach(None):
    print("cannot listen on port", sys.argv[1])
    sys.exit(1)
print("ready", flush=True)
GLib.MainLoop().run()
