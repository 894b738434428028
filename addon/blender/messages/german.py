"""The German of everything that the add-on shows: data, and the loops that spell rows of it out.

Where Blender has a word of its own for the same English, that one is shown in any case; ours are
the same then. `OWN` holds those for which Blender's word would be wrong or too long: its "Face",
for example, is one of a mesh.
"""

from facs_rig import CONTROLS

SIDES = {" left": " links", " right": " rechts"}

# --- what stands on buttons --------------------------------------------------------------------

BUTTONS = {
    # the sketch
    "Sketch to Face": "Gesicht aus Skizze",
    "Draw in the View": "In der Ansicht zeichnen",
    "Sketch to Face Manual": "Handbuch zu Sketch to Face",
    "Manual": "Handbuch",
    "Open the Log": "Protokoll öffnen",
    # what was detected
    "Decide": "Entscheiden",
    "Unlock All": "Alles entsperren",
    "Show Evidence": "Belege zeigen",
    # how it is fitted
    "Fit Again": "Neu anpassen",
    "Use the Chosen Sketch": "Gewählte Skizze verwenden",
    "Try a Sample": "Beispiel ausprobieren",
    "Drag Pins": "Pins ziehen",
    "Pin a Point": "Punkt festpinnen",
    "Remove Pins": "Pins entfernen",
    "Defaults": "Standardwerte",
    "Add a Fit Preset": "Anpass-Vorgabe hinzufügen",
    # what came of it
    "Export": "Exportieren",
    "Export Face": "Gesicht exportieren",
    "Make Hair": "Haar machen",
    "Hair Presets": "Haarvorgaben",
    "Make Beard": "Bart machen",
    # the expression
    "Copy": "Kopieren",
    "Copy Expression": "Ausdruck kopieren",
    "Paste": "Einfügen",
    "Paste Expression": "Ausdruck einfügen",
    "Load Expression": "Ausdruck laden",
    "Save": "Speichern",
    "Save Expression": "Ausdruck speichern",
    "Random": "Zufällig",
    "Random Expression": "Zufälliger Ausdruck",
    "Mirror": "Spiegeln",
    "Mirror Expression": "Ausdruck spiegeln",
    "Neutral": "Neutral",
    "As Drawn": "Gezeichnet",
    "Reset Expression": "Ausdruck zurücksetzen",
    "Key": "Key",
    "Make Independent": "Unabhängig machen",
    "Key Expression": "Ausdruck-Keyframe setzen",
    # the person
    "FACS Face": "FACS-Gesicht",
    "Add FACS Face": "FACS-Gesicht hinzufügen",
    "Random Person": "Zufällige Person",
    "Stylised": "Stilisiert",
    "Stylised Person": "Stilisierte Person",
    "Reset": "Zurücksetzen",
    "Reset Person": "Person zurücksetzen",
    "New Creases": "Neue Falten",
    "Reset Creases": "Falten zurücksetzen",
    # any rig
    "Apply Expression to Selected": "Ausdruck auf Auswahl übertragen",
    "From Face": "Vom Gesicht",
    "From Sketch": "Aus der Skizze",
    "Storyboard": "Storyboard",
}

OWN = {
    # how hair is made
    "Hair": "Haar",
    "Locks": "Strähnen",
    "Surface": "Fläche",
    "Curves": "Kurven",
    "Crop": "Kurz",
    "Side Parting": "Seitenscheitel",
    "Bald Crown": "Glatze mit Kranz",
    "Fringe": "Pony",
    "Bob": "Bob",
    "Long and Straight": "Lang und glatt",
    "Long and Wavy": "Lang und wellig",
    "Curls": "Locken",
    "Afro": "Afro",
    "Bun": "Dutt",
    "Ponytail": "Pferdeschwanz",
    "Braids": "Zöpfe",
    # which beard
    "Beard": "Bart",
    "Hairs": "Haare",
    "As It Was": "Wie er war",
    "Stubble": "Stoppeln",
    "Moustache": "Schnurrbart",
    "Goatee": "Kinnbart",
    "Chin Strap": "Kinnriemen",
    "Full Beard": "Vollbart",
    "Long Beard": "Langer Bart",
    "Curly Beard": "Lockiger Bart",
    "No Beard": "Kein Bart",
    "Ignore": "Ignorieren",
    "None": "Keines",
    "Fit": "Anpassen",
    "Load": "Laden",
    # what the face does, in three narrow buttons
    "Decision": "Entscheidung",
    "Accept": "Ja",
    "Reject": "Nein",
    "Lock": "Fest",
    "Unlock": "Frei",
    # in three narrow buttons, too
    "Sketch From": "Skizze aus",
    "File": "Datei",
    "Image": "Bild",
    "Pencil": "Stift",
    # whose expression
    "From": "Von",
    "Face": "Gesicht",
    "Sketch": "Skizze",
    # what sliders are reset to
    "To": "Auf",
    "Neutral": "Neutral",
    "As Drawn": "Wie gezeichnet",
}

# --- the sliders of a face ---------------------------------------------------------------------

CONTROL_LABELS = {
    "Brow raise": "Brauen heben",
    "Inner brow raise": "Brauen innen heben",
    "Outer brow raise": "Brauen außen heben",
    "Brow furrow": "Stirn runzeln",
    "Upper lid raise": "Oberlid heben",
    "Squint": "Augen verengen",
    "Outer squint": "Wangen heben",
    "Blink": "Blinzeln",
    "Wince": "Nase rümpfen",
    "Sneer": "Höhnen",
    "Nasolabial deepener": "Nasolabialfalte",
    "Cheek puff": "Wangen aufblasen",
    "Cheek suck": "Wangen einziehen",
    "Nostril flare": "Nasenflügel blähen",
    "Nostril compress": "Nasenflügel enger",
    "Smile": "Lächeln",
    "Pucker": "Grübchen",
    "Frown": "Mundwinkel senken",
    "Lower lip depress": "Unterlippe senken",
    "Shrug": "Schmollen",
    "Purse": "Kussmund",
    "Grimace": "Grimasse",
    "Lip loosen": "Lippen stülpen",
    "Upper lip loosen": "Oberlippe stülpen",
    "Lower lip loosen": "Unterlippe stülpen",
    "Lip lock": "Lippen pressen",
    "Upper lip lock": "Oberlippe pressen",
    "Lower lip lock": "Unterlippe pressen",
    "Jaw open": "Kiefer öffnen",
    "Jaw": "Kiefer",
    "Jaw forward": "Kiefer vorschieben",
    "Lip tighten": "Lippen einrollen",
    "Upper lip tighten": "Oberlippe einrollen",
    "Lower lip tighten": "Unterlippe einrollen",
}

# What a control looks like, as its tooltip begins.
SIGNATURES = {
    "worry lines across the whole forehead": "Sorgenfalten über die ganze Stirn",
    "worry lines in the centre of the forehead, brows and lines in a subtle V": (
        "Sorgenfalten in der Mitte der Stirn, Brauen und Falten bilden ein leichtes V"
    ),
    "outer brows raised": "Brauen außen gehoben",
    "brows lowered and drawn together, glabella lines": (
        "Brauen gesenkt und zusammengezogen, Zornesfalten"
    ),
    "eyes wide open": "Augen weit offen",
    "eyes narrowed, crow's feet going down": "Augen verengt, Krähenfüße nach unten",
    "cheeks raised, crow's feet going up": "Wangen gehoben, Krähenfüße nach oben",
    "eyes closed": "Augen geschlossen",
    "nose wrinkled, bunny lines, nasal folds": (
        "Nase gerümpft, Fältchen auf dem Nasenrücken, Falten neben der Nase"
    ),
    "upper lip raised into a wavy line, nasolabial folds": (
        "Oberlippe zu einer Wellenlinie gehoben, Nasolabialfalten"
    ),
    "nasolabial folds deepened in their middle": "Nasolabialfalten in ihrer Mitte vertieft",
    "cheeks blown up": "Wangen aufgeblasen",
    "cheeks drawn in": "Wangen eingezogen",
    "nostrils widened": "Nasenlöcher geweitet",
    "nostrils narrowed": "Nasenlöcher verengt",
    "mouth corners pulled up and back": "Mundwinkel nach oben und hinten gezogen",
    "lip corners pinched and drawn inwards": "Mundwinkel gekniffen und nach innen gezogen",
    "mouth corners turned down": "Mundwinkel nach unten gezogen",
    "lower lip lowered, the mouth of an s": "Unterlippe gesenkt, Mund wie bei einem s",
    "lower lip squashed up, chin boss": "Unterlippe hochgedrückt, Kinn gewölbt",
    "lips pursed for a kiss": "Lippen zum Kuss gespitzt",
    "mouth stretched sideways, lower lip tight": "Mund in die Breite gezogen, Unterlippe straff",
    "lips funnelled, the mouth of a sh": "Lippen trichterförmig, Mund wie bei einem sch",
    "upper lip funnelled": "Oberlippe trichterförmig",
    "lower lip funnelled": "Unterlippe trichterförmig",
    "lips pressed together": "Lippen zusammengepresst",
    "upper lip pressed down": "Oberlippe nach unten gepresst",
    "lower lip pressed up": "Unterlippe nach oben gepresst",
    "mouth open": "Mund offen",
    "jaw moved to the face's left": "Kiefer zur linken Seite des Gesichts verschoben",
    "jaw moved to the face's right": "Kiefer zur rechten Seite des Gesichts verschoben",
    "jaw pushed forward": "Kiefer vorgeschoben",
    "both lips rolled in": "Beide Lippen eingerollt",
    "upper lip rolled in": "Oberlippe eingerollt",
    "lower lip rolled in": "Unterlippe eingerollt",
}

# Muscles go by their Latin names, in German as in English, but for these.
MUSCLES = {
    "Levator palpebrae superioris, relaxed": "Levator palpebrae superioris, entspannt",
    "Zygomatic minor": "Zygomaticus minor",
    "Zygomatic major": "Zygomaticus major",
    "Orbicularis oris, buccinator relaxed": "Orbicularis oris, Buccinator entspannt",
    "Risorius, platysma": "Risorius, Platysma",
    "Digastric, masseter relaxed": "Digastricus, Masseter entspannt",
    "Temporalis, masseter": "Temporalis, Masseter",
    "Lateral pterygoid": "Pterygoideus lateralis",
}

HEAD_AND_EYES = {
    "Eyes Turn": "Augen drehen",
    "Eyes Down": "Augen senken",
    "Both eyes to the face's own left, degrees": (
        "Beide Augen zur linken Seite des Gesichts selbst, in Grad"
    ),
    "Both eyes down, degrees": "Beide Augen nach unten, in Grad",
    "Head Turn": "Kopf drehen",
    "Head Nod": "Kopf nicken",
    "Head Tilt": "Kopf neigen",
    "Neck Turn": "Hals drehen",
    "Neck Nod": "Hals nicken",
    "Neck Tilt": "Hals neigen",
    "{part}: turn its bone": "{part}: Knochen drehen",
    "R": "R",
    "L": "L",
}

# --- the person --------------------------------------------------------------------------------

OWN_WAYS = {
    "Brow actions": "Brauenbewegungen",
    "Eye actions": "Augenbewegungen",
    "Nose actions": "Nasenbewegungen",
    "Cheek actions": "Wangenbewegungen",
    "Smile": "Lächeln",
    "Mouth corner actions": "Mundwinkelbewegungen",
    "Lip actions": "Lippenbewegungen",
    "Jaw actions": "Kieferbewegungen",
}
WAYS = {"shape": "Form", "pull": "Zug", "lopsided": "schief"}

FEATURES = {
    "Gender (female to male)": "Geschlecht (weiblich bis männlich)",
    "Age (six to ninety)": "Alter (sechs bis neunzig)",
    "Weight": "Gewicht",
    "Muscle": "Muskeln",
    "How much age shows": "Wie sehr man das Alter sieht",
    "How much sex shows": "Sichtbares Geschlecht",
    "How much weight shows": "Wie sehr man das Gewicht sieht",
    "African share": "Afrikanischer Anteil",
    "Asian share": "Asiatischer Anteil",
    "Caucasian share": "Europäischer Anteil",
    "Depth of creases": "Faltentiefe",
    "Head width": "Kopfbreite",
    "Head height": "Kopfhöhe",
    "Head depth": "Kopftiefe",
    "Face fullness": "Gesichtsfülle",
    "Head shape (triangle down to up)": "Kopfform (Dreieck abwärts bis aufwärts)",
    "Head shape (square to round)": "Kopfform (eckig bis rund)",
    "Forehead height": "Stirnhöhe",
    "Forehead (back to forward)": "Stirn (fliehend bis vorgewölbt)",
    "Temples": "Schläfen",
    "Eye size": "Augengröße",
    "Eye spacing": "Augenabstand",
    "Eye height": "Augenhöhe",
    "Eye slant (outer corner)": "Augenneigung (äußerer Winkel)",
    "Inner eye corner": "Innerer Augenwinkel",
    "Eye opening": "Augenöffnung",
    "Eye depth": "Augentiefe",
    "Eye fold": "Lidfalte",
    "Eye bags": "Tränensäcke",
    "Brow height": "Brauenhöhe",
    "Brow angle": "Brauenwinkel",
    "Brow ridge": "Brauenwulst",
    "Nose length": "Nasenlänge",
    "Nose position": "Nasenposition",
    "Nose width": "Nasenbreite",
    "Nose bridge width": "Nasenrückenbreite",
    "Nose depth": "Nasentiefe",
    "Nose hump": "Nasenhöcker",
    "Nose tip (down to up)": "Nasenspitze (ab bis auf)",
    "Nose tip width": "Nasenspitzenbreite",
    "Nostril width": "Nasenlochbreite",
    "Mouth width": "Mundbreite",
    "Mouth position": "Mundposition",
    "Mouth corners": "Mundwinkel",
    "Upper lip fullness": "Fülle der Oberlippe",
    "Lower lip fullness": "Fülle der Unterlippe",
    "Lip volume": "Lippenvolumen",
    "Cupid's bow": "Amorbogen",
    "Cheekbones": "Wangenknochen",
    "Cheek volume": "Wangenvolumen",
    "Cheek hollows": "Hohle Wangen",
    "Chin height": "Kinnhöhe",
    "Chin width": "Kinnbreite",
    "Chin (back to forward)": "Kinn (fliehend bis vorspringend)",
    "Jaw width": "Kieferbreite",
    "Jaw height": "Kieferhöhe",
    "Ear size": "Ohrengröße",
    "Ears standing out": "Abstehende Ohren",
    "Neck girth": "Halsumfang",
    "Neck length": "Halslänge",
    **{
        f"{group}: {way}": f"{gruppe}: {weise}"
        for group, gruppe in OWN_WAYS.items()
        for way, weise in WAYS.items()
    },
    "Skin tone (light to dark)": "Hautton (hell bis dunkel)",
    "Skin redness (sallow to ruddy)": "Hautröte (fahl bis gerötet)",
    "Skin gloss (dull to oily)": "Hautglanz (matt bis fettig)",
    "Lip colour (pale to red)": "Lippenfarbe (blass bis rot)",
    "Iris (brown, hazel, green, blue, grey)": "Iris (braun, haselnuss, grün, blau, grau)",
    "Brow colour (blond to black)": "Brauenfarbe (blond bis schwarz)",
    "Grey in the brows": "Grau in den Brauen",
    "Thickness of brows": "Dicke der Brauen",
    "Density of brows": "Dichte der Brauen",
    "Bushy brows": "Buschige Brauen",
    "Brows (straight to arched)": "Brauen (gerade bis geschwungen)",
    "Length of brows": "Länge der Brauen",
    "Higher brow (right or left)": "Höhere Braue (rechts oder links)",
    "Higher eye (right or left)": "Höheres Auge (rechts oder links)",
    "Higher cheek (right or left)": "Höhere Wange (rechts oder links)",
    "Nose aside (right or left)": "Nase zur Seite (rechts oder links)",
    "Higher nostril (right or left)": "Höherer Nasenflügel (rechts oder links)",
    "Higher corner of the mouth (right or left)": "Höherer Mundwinkel (rechts oder links)",
    "Mouth aside (right or left)": "Mund zur Seite (rechts oder links)",
    "Jaw aside (right or left)": "Kiefer zur Seite (rechts oder links)",
    "Higher ear (right or left)": "Höheres Ohr (rechts oder links)",
    "Crease pattern": "Faltenmuster",
}

CREASES = {
    "Worry lines": "Sorgenfalten",
    "Frown lines": "Zornesfalten",
    "Crow's feet": "Krähenfüße",
    "Nose creases": "Nasenfalten",
    "Smile folds": "Lachfalten",
    "Mouth creases": "Mundfalten",
    "Chin creases": "Kinnfalten",
    "Lip creases": "Lippenfalten",
}
TRAITS = {
    "depth": "Tiefe",
    "number": "Anzahl",
    "place": "Lage",
    "length": "Länge",
    "branching": "Verzweigung",
    "left deeper": "links tiefer",
}
FEATURES |= {f"{crease}: {trait}": f"{german}: {word}" for crease, german in CREASES.items()
             for trait, word in TRAITS.items()}  # fmt: skip

GROUPS = {
    "Character": "Charakter",
    "Left and Right": "Links und rechts",
    "Head": "Kopf",
    "Forehead": "Stirn",
    "Brows": "Brauen",
    "Eyes": "Augen",
    "Nose": "Nase",
    "Mouth": "Mund",
    "Cheeks": "Wangen",
    "Chin and Jaw": "Kinn und Kiefer",
    "Ears": "Ohren",
    "Neck": "Hals",
    "Own Ways": "Eigenarten",
    "Colors": "Farben",
    **{english.title().replace("'S", "'s"): german for english, german in CREASES.items()},
}

# --- points of the face ------------------------------------------------------------------------

SIDED_POINTS = {
    "Eye inner": "Auge innen",
    "Eye outer": "Auge außen",
    "Eye top": "Auge oben",
    "Eye bottom": "Auge unten",
    "Pupil": "Pupille",
    "Brow inner": "Braue innen",
    "Brow peak": "Brauenscheitel",
    "Brow outer": "Braue außen",
    "Nose wing": "Nasenflügel",
    "Mouth corner": "Mundwinkel",
    "Cheekbone": "Wangenknochen",
    "Temple": "Schläfe",
    **{f"Jawline {k}": f"Kieferlinie {k}" for k in range(1, 9)},
    "Brow inner half": "Braue halb innen",
    "Brow outer half": "Braue halb außen",
    "Nostril": "Nasenloch",
    "Eye top inner": "Auge oben innen",
    "Eye top outer": "Auge oben außen",
    "Eye bottom inner": "Auge unten innen",
    "Eye bottom outer": "Auge unten außen",
    "Lip peak": "Amorbogen",
    "Lip upper outer": "Oberlippe außen",
    "Lip lower outer": "Unterlippe außen",
    "Lip lower inner": "Unterlippe innen",
    "Mouth inner corner": "Mundwinkel innen",
    "Lip inner upper": "Lippe innen oben",
    "Lip inner lower": "Lippe innen unten",
}

MIDDLE_POINTS = {
    "Nose root": "Nasenwurzel",
    "Nose tip": "Nasenspitze",
    "Nose base": "Nasenbasis",
    "Lip top": "Lippe oben",
    "Lip bottom": "Lippe unten",
    "Chin": "Kinn",
    "Nose bridge upper": "Nasenrücken oben",
    "Nose bridge lower": "Nasenrücken unten",
    "Lip inner top": "Lippe innen Mitte oben",
    "Lip inner bottom": "Lippe innen Mitte unten",
}

# --- panels ------------------------------------------------------------------------------------

PANELS = {
    "Detect": "Erkennen",
    "What was read from the sketch, to be accepted, corrected, rejected, locked.": (
        "Was aus der Skizze gelesen wurde: akzeptieren, korrigieren, ablehnen, sperren."
    ),
    "Expression": "Ausdruck",
    "What can be done with the expression as a whole.": (
        "Was sich mit dem ganzen Ausdruck tun lässt."
    ),
    "Fit": "Einpassen",
    "How the face is brought to the drawing.": "Wie das Gesicht der Zeichnung angepasst wird.",
    "Head and Eyes": "Kopf und Augen",
    "Where the face turns and looks.": "Wohin sich das Gesicht dreht und schaut.",
    "Person": "Person",
    "Who the face is.": "Wer das Gesicht ist.",
    "Upper Face": "Oberes Gesicht",
    "Sliders of the upper face.": "Regler des oberen Gesichts.",
    "Middle Face": "Mittleres Gesicht",
    "Sliders of the middle face.": "Regler des mittleren Gesichts.",
    "Lower Face": "Unteres Gesicht",
    "Sliders of the lower face.": "Regler des unteren Gesichts.",
    "Fit Presets": "Anpass-Vorgaben",
    "The list of presets in the header of the panel Tweakables.": (
        "Die Liste der Vorgaben im Kopf des Bereichs Stellschrauben."
    ),
    "Result": "Ergebnis",
    "How near the face came, what to do with the rest, where it goes.": (
        "Wie nahe das Gesicht kam, was mit dem Rest geschieht, wohin es geht."
    ),
    "On Any Rig": "Auf jedem Rig",
    "An expression on the selected meshes, or a folder of them on the timeline.": (
        "Ein Ausdruck auf den gewählten Meshes, oder ein Ordner davon auf der Zeitleiste."
    ),
    "Sketch": "Skizze",
    "The sketch and the big button.": "Die Skizze und der große Knopf.",
    "Tweakables": "Stellschrauben",
    "The thesis' table, folded away.": "Die Tabelle der Thesis, eingeklappt.",
    "Wrinkles": "Falten",
    "How deep the creases are, and which ones this person has.": (
        "Wie tief die Falten sind, und welche diese Person hat."
    ),
    "Esc stops it": "Esc bricht ab",
    "Apply to Selected": "Auf Auswahl übertragen",
    "Red speaks for it, blue against it": "Rot spricht dafür, Blau dagegen",
    "Dark the sketch, red the face,": "Dunkel die Skizze, rot das Gesicht,",
    "blue what has no place on it": "blau, was keinen Platz darauf hat",
    "Lines {fitted:.1f} px apart, {template:.1f} before": (
        "Abstand {fitted:.1f} px, vorher {template:.1f}"
    ),
    "Fitted Details": "Angepasste Details",
    "Strokes without a place: {count}": "Striche ohne Entsprechung: {count}",
    "This face cannot be posed.": "Dieses Gesicht lässt sich nicht posieren.",
    "Left": "Links",
    "Top": "Oben",
    "Right": "Rechts",
    "Bottom": "Unten",
}

# --- tooltips of the buttons -------------------------------------------------------------------

TOOLTIPS = {
    "Read the sketch and build its face: expression, head and details as sliders": (
        "Die Skizze lesen und ihr Gesicht bauen: Ausdruck, Kopf und Details als Regler"
    ),
    "Fit this face to its sketch once more; locked actions, pins, gaze and keyframes stay": (
        "Dieses Gesicht noch einmal an seine Skizze anpassen; gesperrte Aktionen, Pins, Blick und "
        "Keyframes bleiben"
    ),
    "Let this face be of the sketch chosen above; Fit Again then follows that one": (
        "Das Gesicht der oben gewählten Skizze zuordnen; „Neu anpassen“ folgt dann dieser"
    ),
    "Set everything in this panel back to its default, the tweakables to those of the thesis": (
        "Alles in diesem Bereich auf seinen Standardwert zurücksetzen, die Stellschrauben auf die "
        "Werte der Thesis"
    ),
    "Begin to draw: adds a Grease Pencil object, looks at it from the front, takes the pen": (
        "Mit dem Zeichnen beginnen: fügt ein Grease-Pencil-Objekt hinzu, schaut von vorn darauf, "
        "nimmt den Stift"
    ),
    "Keep how faces are fitted as a preset, or remove one": (
        "Als Vorgabe behalten, wie Gesichter angepasst werden, oder eine Vorgabe entfernen"
    ),
    "Open the manual, which comes with the add-on, at the page of this panel": (
        "Das mitgelieferte Handbuch auf der Seite zu diesem Bereich öffnen"
    ),
    "Open the file in which unexpected errors are written down": (
        "Die Datei öffnen, in der unerwartete Fehler festgehalten werden"
    ),
    "Say whether the drawing shows an action; that is kept when the face is fitted again": (
        "Festlegen, ob die Zeichnung eine Aktion zeigt; das bleibt, wenn das Gesicht neu angepasst "
        "wird"
    ),
    "Let the next fit decide on every action again": (
        "Die nächste Anpassung wieder über jede Aktion entscheiden lassen"
    ),
    "Show which lines of the sketch speak for an action (red) and which against it (blue)": (
        "Zeigen, welche Linien der Skizze für eine Aktion sprechen (rot) und welche dagegen (blau)"
    ),
    "Say where a point of the face lies on its sketch; the next fit brings it there": (
        "Festlegen, wo ein Punkt des Gesichts auf der Skizze liegt; die nächste Anpassung bringt "
        "ihn dorthin"
    ),
    "Take a pin away, or all of them": "Einen Pin entfernen, oder alle",
    "Drag points of the face to where the sketch has them, then fit it again": (
        "Punkte des Gesichts dorthin ziehen, wo die Skizze sie hat, dann neu anpassen"
    ),
    "Make the hair of this face anew, as it was drawn, or take it away": (
        "Das Haar dieses Gesichts neu machen, wie es gezeichnet ist, oder entfernen"
    ),
    "Make the hair anew: a surface with locks on it": (
        "Das Haar neu machen: eine Fläche mit Strähnen darauf"
    ),
    "Make the hair anew: one plain surface, to be sculpted": (
        "Das Haar neu machen: eine glatte Fläche, zum Formen"
    ),
    "Make the hair anew: hair curves that grow on the face, to be groomed, over a thin surface": (
        "Das Haar neu machen: Haarkurven, die auf dem Gesicht wachsen, zum Frisieren, über einer "
        "dünnen Fläche"
    ),
    "Give this face other hair; its length, volume and the color that you gave it stay": (
        "Diesem Gesicht anderes Haar geben; Länge, Fülle und eine selbst gewählte Farbe bleiben"
    ),
    "Which hair": "Welches Haar",
    "Short all over": "Überall kurz",
    "Short, parted at the side": "Kurz, an der Seite gescheitelt",
    "Short around a bald crown": "Kurz um einen kahlen Oberkopf",
    "To the chin, with a fringe": "Bis zum Kinn, mit Pony",
    "To the chin, the forehead free": "Bis zum Kinn, die Stirn frei",
    "Over the shoulders, parted in the middle": "Über die Schultern, in der Mitte gescheitelt",
    "Over the shoulders, in waves": "Über die Schultern, in Wellen",
    "To the chin, in curls": "Bis zum Kinn, in Locken",
    "A round head of tight curls": "Ein runder Kopf aus engen Locken",
    "Combed back into a bun on the crown": "Nach hinten in einen Dutt auf dem Oberkopf gekämmt",
    "Combed back into a ponytail": "Nach hinten in einen Pferdeschwanz gekämmt",
    "Parted in the middle, two braids": "In der Mitte gescheitelt, zwei Zöpfe",
    "What the drawing of this face shows": "Was die Zeichnung dieses Gesichts zeigt",
    "Give this face a beard, make the one that it had anew, or take it away": (
        "Diesem Gesicht einen Bart geben, den neu machen, den es hatte, oder ihn entfernen"
    ),
    "Which beard the face is given": "Welchen Bart das Gesicht bekommt",
    "Make the beard anew that was drawn, or was there last": (
        "Den Bart neu machen, der gezeichnet war oder zuletzt da war"
    ),
    "Some days' growth": "Einige Tage gewachsen",
    "On the upper lip alone": "Auf der Oberlippe allein",
    "On chin and upper lip": "An Kinn und Oberlippe",
    "A narrow rim along the jaw": "Ein schmaler Rand am Kiefer entlang",
    "Up the cheeks, and some centimeters long": "Die Wangen hinauf, und einige Zentimeter lang",
    "Down to the chest": "Bis auf die Brust",
    "Full, and curled": "Voll und gelockt",
    "Take the beard away; it can be made again": (
        "Den Bart entfernen; er lässt sich wieder machen"
    ),
    "Write the face to a file: for other programs, or to be appended in Blender": (
        "Das Gesicht in eine Datei schreiben: für andere Programme, oder zum Anhängen in Blender"
    ),
    "Set the sliders of the face back": "Die Regler des Gesichts zurücksetzen",
    "Copy expression, gaze and head to the clipboard, as text that can be pasted anywhere": (
        "Ausdruck, Blick und Kopf in die Zwischenablage kopieren, als Text, der sich überall "
        "einfügen lässt"
    ),
    "Let the face do what the copied expression says": (
        "Das Gesicht tun lassen, was der kopierte Ausdruck sagt"
    ),
    "Save expression, gaze and head as a JSON file": (
        "Ausdruck, Blick und Kopf als JSON-Datei speichern"
    ),
    "Let the face do what an expression file says": (
        "Das Gesicht tun lassen, was eine Ausdrucksdatei sagt"
    ),
    "Let the face do something that a face can do; head and eyes stay": (
        "Das Gesicht etwas tun lassen, was ein Gesicht tun kann; Kopf und Augen bleiben"
    ),
    "Exchange what the left and the right of the face do": (
        "Vertauschen, was die linke und die rechte Seite des Gesichts tun"
    ),
    "Keyframe every slider, the gaze, head and neck at the current frame": (
        "Für jeden Regler, Blick, Kopf und Hals einen Keyframe am aktuellen Frame setzen"
    ),
    "Add a head with the 47 actions of the Facial Action Coding System as sliders": (
        "Einen Kopf mit den 47 Aktionen des Facial Action Coding System als Regler hinzufügen"
    ),
    "Make the face somebody else; the expression stays": (
        "Aus dem Gesicht jemand anderen machen; der Ausdruck bleibt"
    ),
    "Give the person other creases; who it is and what it does stay": (
        "Der Person andere Falten geben; wer sie ist und was sie tut, bleibt"
    ),
    "Give the person everybody's average creases; who it is and what it does stay": (
        "Der Person die Falten des Durchschnitts geben; wer sie ist und was sie tut, bleibt"
    ),
    "Make the face a stylised person, to go on from; the expression stays": (
        "Aus dem Gesicht eine stilisierte Person zum Weitermachen machen; der Ausdruck bleibt"
    ),
    "Set every identity slider back; the expression stays": (
        "Alle Regler der Person zurücksetzen; der Ausdruck bleibt"
    ),
    "Put an expression on the selected meshes, whatever convention their shape keys follow": (
        "Einen Ausdruck auf die gewählten Meshes übertragen, welcher Konvention ihre Shape Keys "
        "auch folgen"
    ),
    "Make each sketch of the folder a key pose of the selected faces or meshes, from the current "
    "frame on": (
        "Jede Skizze des Ordners zu einer Schlüsselpose der gewählten Gesichter oder Meshes "
        "machen, ab dem aktuellen Frame"
    ),
}

# --- options of the buttons --------------------------------------------------------------------

OPTIONS = {
    "What becomes of it": "Was daraus wird",
    "Take the hair away; it can be made again": ("Das Haar entfernen; es lässt sich wieder machen"),
    "Look at It": "Hinschauen",
    "Turn the 3D view to the new face": "Die 3D-Ansicht zum neuen Gesicht drehen",
    "Page": "Seite",
    "Where the manual is opened": "Wo das Handbuch aufgeschlagen wird",
    "Index": "Index",
    "Tutorial": "Einführung",
    "Any rig": "Jedes Rig",
    "Preferences": "Benutzereinstellungen",
    "Troubleshooting": "Fehlersuche",
    "Action": "Aktion",
    "Name of the control": "Name des Reglers",
    "What is said of the action": "Was über die Aktion gesagt wird",
    "The face does this, however unsure the reading was": (
        "Das Gesicht tut dies, wie unsicher die Erkennung auch war"
    ),
    "The face does not do this, whatever was read": (
        "Das Gesicht tut dies nicht, was auch immer gelesen wurde"
    ),
    "Keep it as it is now": "So lassen, wie es jetzt ist",
    "Let the next fit decide": "Die nächste Anpassung entscheiden lassen",
    "Every Action": "Jede Aktion",
    "Show also what was hardly seen": "Auch zeigen, was kaum zu sehen war",
    "Point": "Punkt",
    "Name of the landmark": "Name des Punkts",
    "Name of the landmark; empty for all": "Name des Punkts; leer für alle",
    "Place": "Ort",
    "Pixels of the sketch, from its left and top": "Pixel der Skizze, von links und von oben",
    "Format": "Format",
    "What kind of file": "Die Art der Datei",
    "glTF (.glb)": "glTF (.glb)",
    "The posed face with a morph target for every action": (
        "Das posierte Gesicht mit einem Morph Target für jede Aktion"
    ),
    "FBX (.fbx)": "FBX (.fbx)",
    "The posed face with a shape key for every action": (
        "Das posierte Gesicht mit einem Shape Key für jede Aktion"
    ),
    "Wavefront (.obj)": "Wavefront (.obj)",
    "The posed face in quads, for sculpting programs": (
        "Das posierte Gesicht in Vierecken, für Sculpting-Programme"
    ),
    "Stanford (.ply)": "Stanford (.ply)",
    "The posed face, coloured": "Das posierte Gesicht, farbig",
    "Blender (.blend)": "Blender (.blend)",
    "The face with sliders and bones, to append to other files": (
        "Das Gesicht mit Reglern und Knochen, zum Anhängen an andere Dateien"
    ),
    "Morph Targets": "Morph Targets",
    "What the actions are called in the file": "Wie die Aktionen in der Datei heißen",
    "Animation": "Animation",
    "Write a face with keyframes as it moves, its bones and shape keys at every frame, instead of "
    "as it is now": (
        "Ein Gesicht mit Keyframes schreiben, wie es sich bewegt, Knochen und Shape Keys an "
        "jedem Frame, statt so, wie es jetzt ist"
    ),
    "Saved {name}; left out: {lost}": "{name} gespeichert; nicht dabei: {lost}",
    "Saved {name}; its hair curves are locks there, for only a .blend can hold curves": (
        "{name} gespeichert; seine Haarkurven sind dort Strähnen, denn Kurven hält nur eine .blend"
    ),
    "Saved {name}; with '{mover}', whose sliders move this face": (
        "{name} gespeichert; dabei ist '{mover}', dessen Regler dieses Gesicht bewegen"
    ),
    "reading the face": "das Gesicht wird gelesen",
    "Give a linked duplicate a mesh, shape keys and sliders of its own; what it shows stays": (
        "Einem verknüpften Duplikat ein eigenes Mesh, eigene Shape Keys und eigene Regler geben; "
        "was es zeigt, bleibt"
    ),
    "Select a linked duplicate of a face": "Ein verknüpftes Duplikat eines Gesichts auswählen",
    "A linked duplicate moves with the sliders of its original: press Make Independent first": (
        "Ein verknüpftes Duplikat bewegt sich mit den Reglern seines Originals: erst Unabhängig "
        "machen drücken"
    ),
    "ARKit": "ARKit",
    "The 47 controls of this add-on": "Die 47 Regler dieses Add-ons",
    "The 52 names that live-capture tools know": (
        "Die 52 Namen, die Werkzeuge zur Live-Aufnahme kennen"
    ),
    "What the sliders are set back to": "Worauf die Regler zurückgesetzt werden",
    "A face at rest that looks ahead": "Ein ruhendes Gesicht, das geradeaus schaut",
    "The expression that was read from the sketch": (
        "Der Ausdruck, der aus der Skizze gelesen wurde"
    ),
    "Head and Neck": "Kopf und Hals",
    "Head and neck too": "Auch Kopf und Hals",
    "Turn head and neck too": "Auch Kopf und Hals drehen",
    "Turn the head of faces that Sketch to Face made too": (
        "Bei Gesichtern von Sketch to Face auch den Kopf drehen"
    ),
    "With the Person": "Mit der Person",
    "Save gender, age and features in the same file": (
        "Geschlecht, Alter und Gesichtszüge in derselben Datei speichern"
    ),
    "The Person Too": "Auch die Person",
    "Become the person in the file, if there is one": (
        "Zu der Person in der Datei werden, wenn es eine gibt"
    ),
    "Seed": "Startwert",
    "Another number, another expression": "Andere Zahl, anderer Ausdruck",
    "Another number, another person": "Andere Zahl, andere Person",
    "Another number, other creases": "Andere Zahl, andere Falten",
    "Identity Sliders": "Regler der Person",
    "Keep gender, age, ethnicity and features in shape keys: their sliders are quicker, and the "
    "face is heavier": (
        "Geschlecht, Alter, Herkunft und Gesichtszüge in Shape Keys halten: ihre Regler sind "
        "schneller, und das Gesicht ist schwerer"
    ),
    "Detail": "Detail",
    "How fine the mesh is; all levels have the same sliders and shape keys": (
        "Wie fein das Mesh ist; alle Stufen haben dieselben Regler und Shape Keys"
    ),
    "Every crease and hair": "Jede Falte und jedes Haar",
    "Medium": "Mittel",
    "A quarter of the polygons, hairs as flat blades": (
        "Ein Viertel der Polygone, Haare als flache Halme"
    ),
    "Game": "Spiel",
    "Under 6,000 triangles, brows and lashes as strips": (
        "Unter 6.000 Dreiecke, Brauen und Wimpern als Streifen"
    ),
    "ARKit Shape Keys": "ARKit-Shape-Keys",
    "Add the 52 shape keys that live-capture tools drive by name": (
        "Die 52 Shape Keys hinzufügen, die Werkzeuge zur Live-Aufnahme beim Namen ansteuern"
    ),
    "Style": "Stil",
    "Whom to start from": "Mit wem begonnen wird",
    "Comic": "Comic",
    "Manga": "Manga",
    "Chibi": "Chibi",
    "Baby face": "Babygesicht",
    "Elegant": "Elegant",
    "Elf": "Elf",
    "Comic hero": "Comicheld",
    "Brute": "Grobian",
    "Caricature": "Karikatur",
    "Big nose": "Große Nase",
    "Long face": "Langes Gesicht",
    "Egg head": "Eierkopf",
    "Puppet": "Puppe",
    "Witch": "Hexe",
    "Large eyes, a round nose, a broad mouth": "Große Augen, runde Nase, breiter Mund",
    "Very large, open eyes over a small nose, mouth and chin": (
        "Sehr große, offene Augen über kleiner Nase, kleinem Mund und Kinn"
    ),
    "A broad head that is nearly all eyes": "Ein breiter Kopf, fast nur Augen",
    "Round cheeks, a high forehead, eyes far down": ("Runde Wangen, hohe Stirn, Augen weit unten"),
    "A long, narrow head on a slender neck": "Ein langer, schmaler Kopf auf schlankem Hals",
    "Slanted eyes, a pointed chin, large ears": "Schräge Augen, spitzes Kinn, große Ohren",
    "A jaw as broad as the skull, on a bull's neck": (
        "Ein Kiefer, so breit wie der Schädel, auf einem Stiernacken"
    ),
    "All jaw and nose, little above the brows": "Nur Kiefer und Nase, wenig über den Brauen",
    "Nose, chin and ears of an old man, drawn large": (
        "Nase, Kinn und Ohren eines alten Mannes, groß gezeichnet"
    ),
    "A nose that comes before everything else": "Eine Nase, die vor allem anderen kommt",
    "Everything drawn out downward": "Alles nach unten gezogen",
    "A great skull over a small face": "Ein großer Schädel über einem kleinen Gesicht",
    "A broad head, round eyes, a ball for a nose": (
        "Ein breiter Kopf, runde Augen, eine Kugel als Nase"
    ),
    "A hooked nose that meets the chin": "Eine Hakennase, die ans Kinn reicht",
    "Random Person": "Zufällige Person",
    "Somebody, instead of the average of everybody": "Irgendjemand statt des Durchschnitts aller",
    "Whose expression it is": "Wessen Ausdruck es ist",
    "The sliders of the active face, or of the one made last": (
        "Die Regler des aktiven Gesichts, oder des zuletzt erstellten"
    ),
    "What is drawn in the chosen sketch; no face is built": (
        "Was in der gewählten Skizze gezeichnet ist; kein Gesicht wird gebaut"
    ),
    "Insert Keyframes": "Keyframes einfügen",
    "Key every shape key that is set, at the current frame": (
        "Für jeden gesetzten Shape Key einen Keyframe am aktuellen Frame einfügen"
    ),
}

# --- settings of the scene, of a face, of the preferences --------------------------------------

SETTINGS = {
    # preferences
    "Quality": "Qualität",
    "How far a fit goes, for the button and for live faces alike": (
        "Wie weit eine Anpassung geht, für den Knopf wie für Live-Gesichter"
    ),
    "Full": "Voll",
    "The lines of the face are brought onto the drawn ones": (
        "Die Linien des Gesichts werden auf die gezeichneten gebracht"
    ),
    "Quick": "Schnell",
    "Person and expression alone: smoother, and a third faster": (
        "Nur Person und Ausdruck: glatter, und um ein Drittel schneller"
    ),
    "Threads": "Threads",
    "Processor cores that reading a sketch may use; 0 for as many as pay": (
        "Prozessorkerne, die das Lesen einer Skizze nutzen darf; 0 für so viele, wie sich lohnen"
    ),
    "Files Go To": "Dateien nach",
    "Where the file browser begins when you save or export; empty for the folder of your .blend "
    "file": (
        "Wo der Dateibrowser beim Speichern und Exportieren beginnt; leer für den Ordner der "
        ".blend-Datei"
    ),
    # which sketch
    "Where the drawing is": "Wo die Zeichnung ist",
    "A picture on the disk: a scan, a photo of paper, an export": (
        "Ein Bild auf der Festplatte: ein Scan, ein Foto vom Papier, ein Export"
    ),
    "Image": "Bild",
    "An image in this file, as you paint it in Blender": (
        "Ein Bild in dieser Datei, wie es in Blender gemalt wird"
    ),
    "What you draw with Grease Pencil in the 3D view": (
        "Was in der 3D-Ansicht mit Grease Pencil gezeichnet wird"
    ),
    "The drawing of a face: PNG, JPEG or whatever your scanner writes": (
        "Die Zeichnung eines Gesichts: PNG, JPEG oder was der Scanner schreibt"
    ),
    "An image in this file that shows a drawn face": (
        "Ein Bild in dieser Datei, das ein gezeichnetes Gesicht zeigt"
    ),
    "Grease Pencil": "Wachsstift",
    "The Grease Pencil object that the face is drawn in": (
        "Das Grease-Pencil-Objekt, in dem das Gesicht gezeichnet ist"
    ),
    # how it is fitted
    "Place the Head by Hand": "Kopf setzen",
    "Say where the head is in the sketch instead of letting it be found": (
        "Festlegen, wo in der Skizze der Kopf ist, statt ihn finden zu lassen"
    ),
    "Box around the head, from crown to chin and ear to ear, in pixels of the sketch: left, top, "
    "right, bottom": (
        "Rahmen um den Kopf, vom Scheitel bis zum Kinn und von Ohr zu Ohr, in Pixeln der Skizze: "
        "links, oben, rechts, unten"
    ),
    "Method": "Methode",
    "How the face is brought to the drawing": "Wie das Gesicht der Zeichnung angepasst wird",
    "By Lines": "Nach Linien",
    "Person and expression first, then its lines onto the drawn": (
        "Erst Person und Ausdruck, dann seine Linien auf die gezeichneten"
    ),
    "Person Only": "Nur Person",
    "Person and expression; the skin stays smooth. Quickest": (
        "Person und Ausdruck; die Haut bleibt glatt. Am schnellsten"
    ),
    "Thesis": "Thesis",
    "The drawn contours slide over the shaded face": (
        "Die gezeichneten Konturen gleiten über das schattierte Gesicht"
    ),
    "Hair": "Haar",
    "What is made of the hair in the drawing": "Was aus dem Haar der Zeichnung wird",
    "A surface with locks on it": "Eine Fläche mit Strähnen darauf",
    "One plain surface, to be sculpted": "Eine glatte Fläche, zum Formen",
    "Make none; hair that the face has stays": ("Keines machen; Haar, das das Gesicht hat, bleibt"),
    "Hair curves on a thin surface, to be groomed; Blender 4.2": (
        "Haarkurven auf einer dünnen Fläche, zum Frisieren; Blender 4.2"
    ),
    "Hair Length": "Haarlänge",
    "Hair Volume": "Haarfülle",
    "How long the hair is, 1 as drawn. The hair is made anew: what you have changed on it goes": (
        "Wie lang das Haar ist, 1 wie gezeichnet. Das Haar wird neu gemacht: was daran von Hand "
        "geändert wurde, geht verloren"
    ),
    "How thick the hair is, 1 as drawn. The hair is made anew: what you have changed on it goes": (
        "Wie füllig das Haar ist, 1 wie gezeichnet. Das Haar wird neu gemacht: was daran von Hand "
        "geändert wurde, geht verloren"
    ),
    "Hair for a face that no drawing gave any.": "Haar für ein Gesicht, das keine Zeichnung hat.",
    "What is made of a beard in the drawing": "Was aus einem Bart der Zeichnung wird",
    "Single hairs, which go with the skin": "Einzelne Haare, die mit der Haut gehen",
    "Make none; a beard that the face has stays": (
        "Keinen machen; ein Bart, den das Gesicht hat, bleibt"
    ),
    "Beard Color": "Bartfarbe",
    "Of the beard as a whole; single hairs are darker and lighter": (
        "Die des ganzen Barts; einzelne Haare sind dunkler und heller"
    ),
    "Hair Color": "Haarfarbe",
    "Of the hair as a whole; its shades are darker and lighter": (
        "Die des ganzen Haars; seine Schattierungen sind dunkler und heller"
    ),
    "How the lines of the drawing pull the face": (
        "Wie die Linien der Zeichnung am Gesicht ziehen"
    ),
    "Strokes Without a Place": "Striche ohne Entsprechung",
    "What becomes of drawn lines that the face does not have, such as scars": (
        "Was aus gezeichneten Linien wird, die das Gesicht nicht hat, etwa Narben"
    ),
    "Ignore": "Ignorieren",
    "Leave them out": "Weglassen",
    "Engrave": "Gravieren",
    "Carve them into the skin": "In die Haut ritzen",
    "Emboss": "Prägen",
    "Raise them from the skin": "Aus der Haut herausheben",
    "Profile": "Profil",
    "Exaggerate": "Übertreiben",
    "How much of the drawn person and expression is shown: 0 a plain face, 1 all, 1.5 more": (
        "Wie viel von Person und Ausdruck gezeigt wird: 0 ein Durchschnittsgesicht, 1 alles, "
        "1,5 mehr"
    ),
    "Caricature": "Karikatur",
    "How much of what makes this person and the expression is shown: 0 a plain face, 1 as drawn, "
    "2 twice as much; what you have changed since stays": (
        "Wie viel von dem gezeigt wird, was Person und Ausdruck ausmacht: 0 ein "
        "Durchschnittsgesicht, 1 wie gezeichnet, 2 doppelt so viel; was seither geändert wurde, "
        "bleibt"
    ),
    "The cut across a carved stroke": "Der Schnitt quer durch einen geritzten Strich",
    "Crease": "Falten",
    "A groove between low rims": "Eine Rille zwischen niedrigen Rändern",
    "Scar": "Narbe",
    "A groove between high rims": "Eine Rille zwischen hohen Rändern",
    "Depth": "Tiefe",
    "How deep a stroke is carved, or how high it is raised (in mm)": (
        "Wie tief ein Strich geritzt oder wie hoch er erhoben wird (in mm)"
    ),
    "Width": "Breite",
    "How wide a carved stroke is; wider where the mesh is coarse (in mm)": (
        "Wie breit ein geritzter Strich ist; breiter, wo das Mesh grob ist (in mm)"
    ),
    # any rig, and what is shown
    "Storyboard": "Storyboard",
    "The folder of sketches that become key poses, in the order of their names": (
        "Der Ordner mit den Skizzen, die Schlüsselposen werden, in der Reihenfolge ihrer Namen"
    ),
    "Frames Apart": "Frame-Abstand",
    "From one sketch's key pose to the next": "Von der Schlüsselpose einer Skizze zur nächsten",
    "Overlay": "Überlagern",
    "Show the lines of the sketch and of the active face over each other, in the front view": (
        "Die Linien der Skizze und des aktiven Gesichts übereinander zeigen, in der Vorderansicht"
    ),
    "One-Sided": "Einseitig",
    "Show the sliders of the face's right and left under those of both": (
        "Die Regler der rechten und linken Gesichtsseite unter denen für beide zeigen"
    ),
    "The next sketch, and how it is fitted": "Die nächste Skizze, und wie sie angepasst wird",
    # what a face remembers
    "What a face remembers of its sketch": "Was ein Gesicht von seiner Skizze behält",
    "Who the face is": "Wer das Gesicht ist",
    "Number": "Nummer",
    "Which of this file's sketches it was, counted from 1": (
        "Die wievielte Skizze dieser Datei es war, gezählt ab 1"
    ),
    "Detections": "Erkanntes",
    "The actions that were read from the sketch": "Die Aktionen, die aus der Skizze gelesen wurden",
    "The action whose buttons are shown below the list": (
        "Die Aktion, deren Knöpfe unter der Liste gezeigt werden"
    ),
    "Pins": "Pins",
    "The points of the face that were put in their place on the sketch": (
        "Die Punkte des Gesichts, die auf der Skizze an ihren Ort gesetzt wurden"
    ),
    "The sliders as the sketch has them": "Die Regler, wie die Skizze sie hat",
    "How the drawn head is turned": "Wie der gezeichnete Kopf gedreht ist",
    "How the drawn neck is turned": "Wie der gezeichnete Hals gedreht ist",
    "Camera": "Kamera",
    "Turn": "Drehung",
    "Quarter turns anticlockwise that stand the sketch upright": (
        "Vierteldrehungen gegen den Uhrzeigersinn, die die Skizze aufrecht stellen"
    ),
    "Pixels of the sketch for a metre of the face, and where its pivot lies": (
        "Pixel der Skizze für einen Meter des Gesichts, und wo sein Drehpunkt liegt"
    ),
    "Distance": "Abstand",
    "From the face's pivot to the eye that saw it, in metres; 0 is infinite": (
        "Vom Drehpunkt des Gesichts zum Auge, das es sah, in Metern; 0 ist unendlich"
    ),
    "Closeness": "Nähe",
    "How far that eye is from the drawn features, as a share of its distance": (
        "Wie weit dieses Auge von den gezeichneten Zügen ist, als Anteil seines Abstands"
    ),
    "From pixels of the sketch to the places of pins, two rows": (
        "Von Pixeln der Skizze zu den Orten der Pins, zwei Zeilen"
    ),
    "Contour error": "Konturfehler",
    "Pixels between the sketch and the template, the expression, the fit": (
        "Pixel zwischen der Skizze und der Vorlage, dem Ausdruck, der Anpassung"
    ),
    "Live": "Live",
    "Watch the sketch, and fit this face again whenever it changes": (
        "Die Skizze beobachten, und das Gesicht neu anpassen, sobald sie sich ändert"
    ),
    "Strokes": "Striche",
    "What became of strokes without a place when it was fitted": (
        "Was beim Anpassen aus Strichen ohne Entsprechung wurde"
    ),
    "Mark": "Markierung",
    "The state of the sketch that this face was fitted to": (
        "Der Stand der Skizze, an die dieses Gesicht angepasst wurde"
    ),
    # what was read
    "Probability": "Wahrscheinlichkeit",
    "How likely the drawing shows this action": (
        "Wie wahrscheinlich die Zeichnung diese Aktion zeigt"
    ),
    "As Read": "Wie gelesen",
    "How strong the action was read, 0 if it was not seen": (
        "Wie stark die Aktion gelesen wurde, 0, wenn sie nicht zu sehen war"
    ),
    "Accept": "Akzeptieren",
    "Whether the face does this; a tick that you set or take away is kept when the face is fitted "
    "again": (
        "Ob das Gesicht dies tut; ein gesetztes oder entferntes Häkchen bleibt, wenn das Gesicht "
        "neu angepasst wird"
    ),
    "Intensity": "Intensität",
    "How strongly the face does this, 5 is fully natural; a value that you set is kept when the "
    "face is fitted again": (
        "Wie stark das Gesicht dies tut, 5 ist die volle natürliche Stärke; ein gesetzter Wert "
        "bleibt, wenn das Gesicht neu angepasst wird"
    ),
    "Lock": "Sperre",
    "Keep this action as it is now when the face is fitted again": (
        "Diese Aktion so lassen, wie sie jetzt ist, wenn das Gesicht neu angepasst wird"
    ),
    "Value": "Wert",
    "As the sketch has it": "Wie die Skizze ihn hat",
    "Where this point lies: pixels from the picture's left and top, or metres in the plane of a "
    "Grease Pencil drawing": (
        "Wo dieser Punkt liegt: Pixel von links und oben im Bild, oder Meter in der Ebene einer "
        "Grease-Pencil-Zeichnung"
    ),
}

TWEAKABLES = {
    "Gap closing": "Lücken schließen",
    "Side of the square that closes gaps in the drawn lines; 1 closes nothing (in px)": (
        "Seite des Quadrats, das Lücken in den gezeichneten Linien schließt; 1 schließt nichts "
        "(in px)"
    ),
    "Thinning iterations": "Durchgänge beim Ausdünnen",
    "How often a layer is peeled off the drawn lines; 0 leaves them as thick as they are": (
        "Wie oft von den gezeichneten Linien eine Schicht abgetragen wird; 0 lässt sie so dick, "
        "wie sie sind"
    ),
    "Snake type": "Snake-Typ",
    "What the ends of a snake do: move freely, stay where they were drawn, or meet": (
        "Was die Enden einer Snake tun: sich frei bewegen, am gezeichneten Ort bleiben oder sich "
        "treffen"
    ),
    "Free": "Frei",
    "Fixed": "Fixiert",
    "Periodic": "Periodisch",
    "Snake smoothness": "Snake-Glätte",
    "Higher values give smoother snakes that capture fewer details": (
        "Höhere Werte ergeben glattere Snakes, die weniger Details erfassen"
    ),
    "Snake time stepping": "Snake-Trägheit",
    "Inertia of a snake: higher values make it move in smaller steps": (
        "Trägheit einer Snake: bei höheren Werten bewegt sie sich in kleineren Schritten"
    ),
    "Snake max step": "Größter Snake-Schritt",
    "Farthest that a snake moves in one iteration; lower values such as 0.3 can fit better "
    "(in px)": (
        "Wie weit sich eine Snake in einem Durchgang höchstens bewegt; kleinere Werte wie 0,3 "
        "können besser passen (in px)"
    ),
    "Snake max iterations": "Höchste Zahl der Snake-Durchgänge",
    "A snake that has not come to rest after this many iterations is taken as it is": (
        "Eine Snake, die nach so vielen Durchgängen nicht ruht, wird genommen, wie sie ist"
    ),
    "Snake convergence": "Snake-Konvergenz",
    "A snake rests once no point moves farther than this; at 1.0 it hardly moves (in px)": (
        "Eine Snake ruht, sobald sich kein Punkt weiter bewegt; bei 1,0 bewegt sie sich kaum "
        "(in px)"
    ),
    "Snake brightness weight": "Snake-Gewicht der Helligkeit",
    "Negative values push a snake to dark places of the render, positive ones to bright places": (
        "Negative Werte schieben eine Snake zu dunklen Stellen des Renderbilds, positive zu hellen"
    ),
    "Snake edge weight": "Snake-Kantengewicht",
    "Positive values push a snake to edges of the render, negative ones away from them": (
        "Positive Werte schieben eine Snake zu den Kanten des Renderbilds, negative von ihnen weg"
    ),
    "Max delta": "Größter Abstand",
    "A snake point that moved farther than this did not find its line and is left out (in px)": (
        "Ein Punkt der Snake, der sich weiter bewegt hat, fand seine Linie nicht und wird "
        "weggelassen (in px)"
    ),
    "Low depth preference": "Vorrang geringer Tiefe",
    "0 moves the vertex nearest to a pixel, 1 the one nearest to the viewer around it": (
        "0 bewegt den Vertex, der einem Pixel am nächsten liegt, 1 den, der in seiner Umgebung dem "
        "Betrachter am nächsten liegt"
    ),
    "Soft select distance": "Reichweite der weichen Auswahl",
    "How far the movement of a vertex reaches into the skin around it (in cm)": (
        "Wie weit die Bewegung eines Vertex in die Haut ringsum reicht (in cm)"
    ),
    "Soft select curve": "Kurve der weichen Auswahl",
    "How the movement of a vertex falls off with distance": (
        "Wie die Bewegung eines Vertex mit der Entfernung abnimmt"
    ),
    "Smooth": "Weich",
    "Sphere": "Kugel",
    "Root": "Wurzel",
    "Inverse square": "Inverses Quadrat",
    "Sharp": "Scharf",
    "Linear": "Linear",
    "Constant": "Konstant",
    "Soft select connected": "Weiche Auswahl nur verbunden",
    "Measure distance over the skin, so that a lip does not pull the other lip": (
        "Entfernung über die Haut messen, damit eine Lippe nicht die andere mitzieht"
    ),
    "Symmetry": "Symmetrie",
    "How alike both sides of the face are moved: 0 each by its own lines, 1 as mirror images": (
        "Wie gleich beide Seiten des Gesichts bewegt werden: 0 jede nach ihren eigenen Linien, "
        "1 spiegelbildlich"
    ),
    "Mirror output": "Spiegelgleich",
    "Make the fitted face symmetrical, which removes asymmetries of the drawing": (
        "Das angepasste Gesicht symmetrisch machen, was Asymmetrien der Zeichnung entfernt"
    ),
}

# --- what is reported --------------------------------------------------------------------------

SENTENCES = {
    "This face has no hair: choose one of the presets": (
        "Dieses Gesicht hat kein Haar: wähle eine der Vorgaben"
    ),
    "No hair was found in the drawing of this face": (
        "In der Zeichnung dieses Gesichts wurde kein Haar gefunden"
    ),
    "This face has had no beard yet: choose one of the others": (
        "Dieses Gesicht hatte noch keinen Bart: einen der anderen wählen"
    ),
    # what a button is at; the panel writes the first letter large
    "getting ready": "bereite vor",
    "reading {name}": "lese {name}",
    "reading the sketch": "lese die Skizze",
    "reading the sketch of {name}": "lese die Skizze von {name}",
    "measuring {name}": "vermesse {name}",
    "A hat was seen of which none could be made": (
        "Ein Hut war zu sehen, aus dem keiner gemacht werden konnte"
    ),
    "It is rather a painting or a photograph: a line drawing is read better": (
        "Die Skizze ist eher ein Gemälde oder ein Foto: Strichzeichnungen werden besser gelesen"
    ),
    "The sketch lies on its side: it was turned to be read": (
        "Die Skizze liegt auf der Seite: sie wurde zum Lesen gedreht"
    ),
    "The sketch is upside down: it was turned to be read": (
        "Die Skizze steht auf dem Kopf: sie wurde zum Lesen gedreht"
    ),
    "shaping {name}": "forme {name}",
    "writing {name}": "schreibe {name}",
    "erasing the sketch patch by patch": "radiere die Skizze Stück für Stück weg",
    "{number} of {total}, {name}": "{number} von {total}, {name}",
    "{title}: {doing}    Esc: stop": "{title}: {doing}    Esc: abbrechen",
    "Still at work: {doing}": "Noch bei der Arbeit: {doing}",
    "{title} was stopped; nothing has changed": "{title} wurde abgebrochen; nichts ist verändert",
    "{title} broke ({kind}); details: {path}": (
        "{title} ist gescheitert ({kind}); Einzelheiten: {path}"
    ),
    "Drag a point to its place    Ctrl Click: remove    Enter: fit again    Esc: leave": (
        "Punkt an seinen Ort ziehen    Strg-Klick: entfernen    Enter: neu anpassen    "
        "Esc: verlassen"
    ),
    # what a button did
    "no expression found": "kein Ausdruck gefunden",
    "Saved {name}": "{name} gespeichert",
    "Expression copied": "Ausdruck kopiert",
    "Expression applied to {names}": "Ausdruck übertragen auf {names}",
    "{name} ({convention}, {keys} keys)": "{name} ({convention}, {keys} Keys)",
    "{names} and {more} more": "{names} und {more} weitere",
    "no key was found for {names}": "kein Key gefunden für {names}",
    "driven by something else: {names}": "von etwas anderem gesteuert: {names}",
    "1 key pose on {names}, frame {frame}": "1 Schlüsselpose auf {names}, Frame {frame}",
    "{count} key poses on {names}, frames {first} to {last}": (
        "{count} Schlüsselposen auf {names}, Frames {first} bis {last}"
    ),
    "stopped after {done} of {total} sketches": "abgebrochen nach {done} von {total} Skizzen",
    "left out {names}": "ausgelassen: {names}",
    "The log is empty: nothing unexpected has happened": (
        "Das Protokoll ist leer: Nichts Unerwartetes ist geschehen"
    ),
    # why it cannot be pressed
    "Select a face that Sketch to Face made": "Ein Gesicht von Sketch to Face auswählen",
    "Select a face that was made of a sketch": (
        "Ein Gesicht auswählen, das aus einer Skizze entstand"
    ),
    "This face is linked from another file: make it local first": (
        "Dieses Gesicht ist aus einer anderen Datei verlinkt: erst lokal machen"
    ),
    "Leave Edit Mode first": "Erst den Bearbeitungsmodus verlassen",
    "Go to Object Mode first": "Erst in den Objektmodus wechseln",
    "Select the meshes that are to wear the expression": (
        "Die Meshes auswählen, die den Ausdruck tragen sollen"
    ),
    # what is missing or wrong
    "No sketch is chosen: pick the image of a drawn face first.": (
        "Keine Skizze gewählt: erst das Bild eines gezeichneten Gesichts auswählen."
    ),
    "No image is chosen: pick one of this file's images first.": (
        "Kein Bild gewählt: erst eines der Bilder dieser Datei auswählen."
    ),
    "The image '{name}' has no pixels; is its file missing?": (
        "Das Bild „{name}“ hat keine Pixel; fehlt seine Datei?"
    ),
    "No drawing is chosen: pick the Grease Pencil object you drew first.": (
        "Keine Zeichnung gewählt: erst das gezeichnete Grease-Pencil-Objekt auswählen."
    ),
    "'{face}' knows of no action '{name}': fit it to a sketch first.": (
        "„{face}“ kennt keine Aktion „{name}“: erst an eine Skizze anpassen."
    ),
    "There is no point '{name}' on a face{guess}.": (
        "Einen Punkt „{name}“ gibt es auf einem Gesicht nicht{guess}."
    ),
    "Pins are dragged in the 3D view: press the button there": (
        "Pins werden in der 3D-Ansicht gezogen: den Knopf dort drücken"
    ),
    "Choose one of the drawings that come with the add-on, to see what the button does": (
        "Eine der Zeichnungen wählen, die das Add-on mitbringt, um zu sehen, was der Knopf tut"
    ),
    "Drawing": "Zeichnung",
    "Which of them": "Welche davon",
    "Smiling Woman": "Lachende Frau",
    "A woman who laughs": "Eine Frau, die lacht",
    "Angry Man": "Wütender Mann",
    "A man who shouts": "Ein Mann, der schreit",
    "Worried Old Man": "Besorgter alter Mann",
    "An old man with a lined forehead": "Ein alter Mann mit faltiger Stirn",
    "'{name}' is a movie: save the frame that you mean as a picture, and choose that.": (
        "„{name}“ ist ein Film: das gemeinte Einzelbild als Bild speichern und dieses auswählen."
    ),
    "Nobody can read the pixels of '{name}': save it with Image > Save As, and choose that file.": (
        "Die Pixel von „{name}“ kann niemand lesen: mit Bild > Speichern unter sichern und die "
        "Datei auswählen."
    ),
    "The sample drawings are missing: install the add-on's zip again": (
        "Die Beispielzeichnungen fehlen: die Zip-Datei des Add-ons neu installieren"
    ),
    "'{path}' cannot be used: {error}": "„{path}“ ist nicht zu gebrauchen: {error}",
    "'{path}' names no file; say which one to write.": (
        "„{path}“ nennt keine Datei; angeben, welche geschrieben werden soll."
    ),
    "There is no folder '{folder}'; choose one that is there.": (
        "Den Ordner „{folder}“ gibt es nicht; einen vorhandenen auswählen."
    ),
    "the clipboard is empty: copy an expression first": (
        "die Zwischenablage ist leer: erst einen Ausdruck kopieren"
    ),
    "The clipboard holds no expression: {error}": (
        "In der Zwischenablage ist kein Ausdruck: {error}"
    ),
    "The manual is missing: install the add-on's zip again": (
        "Das Handbuch fehlt: die Zip-Datei des Add-ons neu installieren"
    ),
    "it is not clear which face gives the expression: select it too, or take the expression from "
    "the sketch": (
        "es ist nicht klar, welches Gesicht den Ausdruck gibt: dieses mit auswählen, oder den "
        "Ausdruck aus der Skizze nehmen"
    ),
    "there is no face to take the expression from: make one, or take it from the sketch": (
        "es gibt kein Gesicht, das den Ausdruck geben kann: eines erstellen, oder ihn aus der "
        "Skizze nehmen"
    ),
    "select the meshes that are to wear the expression": (
        "die Meshes auswählen, die den Ausdruck tragen sollen"
    ),
    "select the meshes that are to wear the expression besides '{name}'": (
        "außer „{name}“ die Meshes auswählen, die den Ausdruck tragen sollen"
    ),
    "no folder is chosen: pick the one that your sketches are in": (
        "kein Ordner gewählt: den mit den Skizzen auswählen"
    ),
    "None of the sketches could be read: {trouble}": "Keine der Skizzen war lesbar: {trouble}",
    # in Blender's list of add-ons
    "Sketch to Face": "Sketch to Face",
    "3D View > Sidebar > Sketch to Face": "3D-Ansicht > Seitenleiste > Sketch to Face",
    "A drawing of a face becomes a posable 3D face": (
        "Aus der Zeichnung eines Gesichts wird ein posierbares 3D-Gesicht"
    ),
}


def _controls() -> dict[str, str]:
    """Label and tooltip of every slider; the tooltip has look, action units and muscle."""
    found = {}
    for control in CONTROLS:
        side = f" {control.side}"
        action = control.label.removesuffix(side)
        if action in CONTROL_LABELS:
            there = SIDES[side] if action != control.label else ""
            found[control.label] = CONTROL_LABELS[action] + there
        look, units = control.signature, ", ".join(control.aus)
        english = f"{look[:1].upper()}{look[1:]} (AU {units}, {control.muscle})"
        muscle = MUSCLES.get(control.muscle, control.muscle)
        german = f"{SIGNATURES.get(look, look)} (AU {units}, {muscle})"
        found[f"{english}; 5 is fully natural"] = f"{german}; 5 ist die volle natürliche Stärke"
    return found


def _sided(words: dict[str, str]) -> dict[str, str]:
    """Each word on the left and on the right."""
    return {english + side: german + there
            for english, german in words.items() for side, there in SIDES.items()}  # fmt: skip


# Context in which Blender looks a text up -> English -> German.
TABLE: dict[str, dict[str, str]] = {
    "*": {
        **_controls(),
        **_sided(SIDED_POINTS),
        **MIDDLE_POINTS,
        **HEAD_AND_EYES,
        **FEATURES,
        **{f"{english} of this person": f"{german} dieser Person"
           for english, german in FEATURES.items()},
        **GROUPS,
        **{f"Sliders of the person: {english.lower()}.": f"Regler der Person: {german}."
           for english, german in GROUPS.items()},
        **PANELS,
        **TOOLTIPS,
        **OPTIONS,
        **SETTINGS,
        **TWEAKABLES,
        **SENTENCES,
    },
    "Operator": BUTTONS,
    "Sketch to Face": OWN,
}  # fmt: skip
