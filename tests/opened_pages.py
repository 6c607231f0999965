"""A page in the browser, as a reader opens it."""

from contextlib import contextmanager
from pathlib import Path


@contextmanager
def open_page(browser, address, *, patience_ms=60_000, **context):
    """The page at an address, or of a file; `asked` lists what it fetches, `wrong` its errors and messages."""
    own = browser.new_context(**context)
    page = own.new_page()
    page.set_default_timeout(patience_ms)
    page.asked, page.wrong = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("console", lambda message: page.wrong.append(message.text))
    page.goto(address.as_uri() if isinstance(address, Path) else address)
    try:
        yield page
    finally:
        own.close()
