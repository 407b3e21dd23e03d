"""Another program on this computer, with a page of another origin that knows the address and the token."""

import contextlib
import http.server
import threading

_PAGE = """<!doctype html><link rel="icon" href="data:,"><iframe src="BASE#TOKEN"></iframe><p></p><script>
const headers = {'X-Rotorid-Token': 'TOKEN'};
const body = JSON.stringify({edits: [{cell: 'phase', old: 'lead', new: 'lag'}]});
const tries = [fetch('BASEstate', {headers}), fetch('BASEedit', {method: 'POST', headers, body}),
  fetch('BASEedit', {method: 'POST', mode: 'no-cors', headers, body})];
Promise.allSettled(tries).then(all => document.querySelector('p').textContent = all.map(
  one => one.status + ' ' + (one.value?.type || '')).join(', '));
</script>"""


@contextlib.contextmanager
def stranger(address):
    """The address of a page that tries to read, to write with and without leave, and to frame."""
    base, token = address.split("#")
    page = _PAGE.replace("BASE", base).replace("TOKEN", token).encode()

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, *words):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
