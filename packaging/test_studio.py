"""Starts the studio by a command, and requests its page.

    python3 packaging/test_studio.py COMMAND ...
"""

import subprocess
import sys
import urllib.request

server = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE, text=True)
try:
    address = server.stdout.readline().strip()
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    page = browser.open(address, timeout=20).read().decode()
    assert "<script" in page, page
    print("the studio's page:", len(page), "bytes")
finally:
    server.terminate()
    server.wait()
