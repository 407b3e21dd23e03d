"""A window of the worksheet in a real browser, used by keyboard alone."""

import time

# As WebDriver writes them; here, because selenium may be missing.
TAB, ENTER, SPACE, UP, DOWN = "\ue004", "\ue007", "\ue00d", "\ue013", "\ue015"
SHIFT, CONTROL = "\ue008", "\ue009"

# How many Tabs lead to what is looked for, about; negative: backwards; null: there is none.
_TABS = """
const wanted = document.querySelector(arguments[0]);
const kinds = 'a[href], button, input, select, summary, [tabindex="0"]';
const all = [...document.querySelectorAll(kinds)].filter(e => !e.disabled && e.getClientRects().length);
return wanted && all.indexOf(wanted) - all.indexOf(document.activeElement);
"""
_TEXTS = """
return Array.from(document.querySelectorAll(arguments[0])).map(
  e => e.dataset.value ?? (e.matches('input, select') ? e.value : e.textContent));
"""
_NUMBERS = """
return Array.from(document.querySelectorAll(arguments[0])).map(e => [e.dataset.key, e.textContent]);
"""
_PASTE = """
const clipboardData = new DataTransfer();
clipboardData.setData('text', arguments[0]);
const kind = {clipboardData, bubbles: true, cancelable: true};
document.activeElement.dispatchEvent(new ClipboardEvent('paste', kind));
"""
MOST_TRIES = 20


class Window:
    """One window."""

    def __init__(self, browser):
        self.browser, self.driver = browser, browser.driver

    def open(self, address):
        """The page, as soon as it shows the job."""
        self.driver.get("about:blank")  # for another token alone the browser loads nothing
        visit = self.browser.open(address)
        self.wait(lambda: self.text("#job") != "rotorid worksheet", "the job is shown")
        return visit

    def wait(self, met, what):
        """Until something is met; what it returned."""
        until = time.monotonic() + 30
        while time.monotonic() < until:
            if found := met():
                return found
            time.sleep(0.02)
        raise AssertionError(f"not within 30 s: {what}; the page shows:\n{self.browser.text()}")

    def actions(self):
        """Keys to come."""
        from selenium.webdriver import ActionChains

        return ActionChains(self.driver, duration=0)

    def press(self, *keys):
        """Keys, one after the other."""
        self.actions().send_keys(*keys).perform()

    def hold(self, modifier, key):
        """A key together with a modifier."""
        self.actions().key_down(modifier).send_keys(key).key_up(modifier).perform()

    def go(self, selector):
        """Move the focus there by Tab."""
        self.wait(lambda: self.texts(selector), f"there is a {selector}")
        for _ in range(MOST_TRIES):
            if not (tabs := self.driver.execute_script(_TABS, selector)):
                return
            actions = self.actions()
            if tabs < 0:
                actions.key_down(SHIFT)
            actions.send_keys(TAB * abs(tabs)).perform()
            actions.reset_actions()  # lets go of the keys
        raise AssertionError(f"{selector} cannot be reached by Tab")

    def type(self, selector, text):
        """Go to a field, and type into it in place of what it holds."""
        self.go(selector)
        if self.texts(selector) != [""]:
            self.hold(CONTROL, "a")
        self.press(*text)

    def leave(self):
        """Go on to the next field: what was typed is finished."""
        self.press(TAB)

    def next(self, text):
        """Type into the field after this one."""
        self.leave()
        self.press(*text)

    def push(self, selector, key=ENTER):
        """A button."""
        self.go(selector)
        self.press(key)

    def saved(self):
        """Wait until all is saved."""
        self.wait(lambda: self.text("#saved").startswith(("saved", "all is saved")), "all is saved")

    def text(self, selector):
        """What the first one shows."""
        return self.texts(selector)[0]

    def texts(self, selector):
        """What all of them show: the text, or what a cell holds."""
        return self.driver.execute_script(_TEXTS, selector)

    def numbers(self):
        """Numbers of the answer, as shown, by their places in the document."""
        return dict(self.driver.execute_script(_NUMBERS, "#answer [data-key]"))

    def paste(self, text):
        """What Ctrl+V does with a text from a spreadsheet."""
        self.driver.execute_script(_PASTE, text)
