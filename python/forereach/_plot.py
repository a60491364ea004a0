"""Pictures of decisions, by matplotlib."""


def plot(decision, ax=None):
    import matplotlib.patches as patches
    import matplotlib.pyplot as pyplot

    if ax is None:
        ax = pyplot.subplots()[1]
    picture = decision._picture()
    color = "tab:blue" if decision.certified else "tab:orange"
    for corners in picture["tube"]:
        ax.add_patch(patches.Polygon(corners, facecolor=color, edgecolor=color, alpha=0.25))
    ax.plot(*picture["path"].T, color=color, linewidth=1, marker=".", markersize=3)
    for corners in picture["obstacles"]:
        ax.add_patch(patches.Polygon(corners, facecolor="0.4", edgecolor="black"))
    for corners in picture["predictions"]:
        ax.add_patch(patches.Polygon(corners, facecolor="none", edgecolor="0.4", linestyle=":"))
    ax.set_aspect("equal", adjustable="datalim")
    ax.autoscale_view()
    for a, b, offset in picture["half_planes"]:  # a x + b y >= offset, as far as the axes reach
        x, y = a * offset / (a * a + b * b), b * offset / (a * a + b * b)
        ax.axline((x, y), (x - b, y + a), color="black")
    ax.set(xlabel="m", ylabel="m", title="certified" if decision.certified else decision.outcome)
    return ax
